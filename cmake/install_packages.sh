# Sourced by `check` and `demo`: installs what packages.txt names and dpkg does not have.
# install_packages yes|no: with no, missing packages are named and the script ends.

install_packages() {
  local list missing=() package root=()
  list=$(sed 's/#.*//' "$(dirname "${BASH_SOURCE[0]}")/packages.txt")
  if ! command -v dpkg-query > /dev/null; then
    echo "This is no Debian system; these packages are expected to be here: ${list//$'\n'/ }" >&2
    return 0
  fi
  for package in $list; do
    [[ $(dpkg-query -W -f='${Status}' "$package" 2> /dev/null) == "install ok installed" ]] ||
      missing+=("$package")
  done
  [[ ${#missing[@]} -eq 0 ]] && return 0
  if [[ $1 == no ]]; then
    echo "Missing packages: ${missing[*]}" >&2
    exit 1
  fi
  [[ $(id -u) -eq 0 ]] || root=(sudo)
  echo "Installing ${missing[*]}"
  export DEBIAN_FRONTEND=noninteractive
  "${root[@]}" apt-get update -q < /dev/null
  "${root[@]}" apt-get install -q -y --no-install-recommends "${missing[@]}" < /dev/null
}
