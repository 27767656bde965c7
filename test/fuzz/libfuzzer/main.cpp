// libFuzzer's entry points: `fuzz --target=NAME [libFuzzer's own options] CORPUS...`.
//   --list             prints the targets
//   --seeds=FOLDER     writes the sound specimens of the target and its words as FOLDER.words

#include <fmt/format.h>
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "../targets.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/volume/vdb_file.h"

namespace fs = std::filesystem;
using photosphere::fuzz::Target;

namespace {

const Target* g_target = nullptr;
fs::path g_folder;

[[noreturn]] void leave(int code, const std::string& message = {}) {
  if (!message.empty()) fmt::print(stderr, "{}\n", message);
  std::fflush(nullptr);
  _exit(code);
}

void writeFile(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// A libFuzzer dictionary: one quoted word a line, other bytes than letters as \xNN.
void writeSeeds(const Target& target, const fs::path& folder) {
  fs::create_directories(folder);
  for (const auto& specimen : photosphere::fuzz::specimens())
    if (specimen.target == target.name) writeFile(folder / specimen.name, specimen.content());
  std::string words;
  for (const std::string& word : target.words) {
    words += '"';
    for (const char c : word)
      words += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    words += "\"\n";
  }
  writeFile(folder.string() + ".words", words);
}

/// In memory where the system has such a place.
fs::path workFolder() {
  const fs::path shared = "/dev/shm";
  std::string name =
      ((fs::exists(shared) ? shared : fs::temp_directory_path()) / "fuzz-XXXXXX").string();
  if (!mkdtemp(name.data())) leave(2, "cannot make a folder to work in");
  return name;
}

/// A crash of a process that looks at a file for us is an answer and no finding.
void leaveCrashesToParent() {
  __sanitizer_set_death_callback(nullptr);
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGXFSZ})
    ::signal(signal, SIG_DFL);
}

void removeFolder() {
  std::error_code ignored;
  fs::remove_all(g_folder, ignored);
}

/// What a sanitizer said in the process that looks first: no finding, as it was held there, but to
/// be known. Each once.
void tellContained(const std::string& reason) {
  static std::set<std::string> told;
  const std::size_t begin = reason.find("SUMMARY: ");
  if (begin == std::string::npos) return;
  const std::string line = reason.substr(begin, reason.find('\n', begin) - begin);
  if (told.insert(line).second) fmt::print(stderr, "contained: {}\n", line);
}

/// Whether a process of its own reads the .vdb, as `inspect` asks before it reads one.
bool isReadElsewhere(const std::string& bytes) {
  const fs::path path = g_folder / "probed.vdb";
  writeFile(path, bytes);
  std::string reason;
  const bool read = photosphere::volume::probeVdb(path, reason);
  tellContained(reason);
  return read;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  std::string name, seeds;
  for (int i = 1; i < *argc; ++i) {
    const std::string word = (*argv)[i];
    if (word == "--list") {
      for (const Target& target : photosphere::fuzz::targets())
        fmt::print("{}\n", target.name);
      leave(0);
    }
    if (word.starts_with("--target=")) name = word.substr(9);
    if (word.starts_with("--seeds=")) seeds = word.substr(8);
  }
  g_target = photosphere::fuzz::findTarget(name);
  if (!g_target) leave(2, "no target '" + name + "'; `fuzz --list` shows them");
  photosphere::log::setLevel(photosphere::log::Level::off);
  if (!seeds.empty()) {
    writeSeeds(*g_target, seeds);
    leave(0);
  }
  g_folder = workFolder();
  std::atexit(removeFolder);
  pthread_atfork(nullptr, nullptr, leaveCrashesToParent);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  if (g_target->isolated && !isReadElsewhere(bytes)) return 0;
  try {
    g_target->read(bytes, g_folder);
  } catch (const photosphere::Error&) {
    // Refused, with a message.
  }
  return 0;
}
