#include "photosphere/core/shipped_data.h"

#include <cstdlib>

namespace photosphere {

namespace fs = std::filesystem;

std::vector<fs::path> shippedPlaces(const fs::path& relative) {
  std::vector<fs::path> places;
  if (const char* data = std::getenv("PHOTOSPHERE_DATA"); data && *data)
    places.push_back(data / relative);
  std::error_code error;
  const fs::path executable = fs::read_symlink("/proc/self/exe", error);
  if (!error)
    places.push_back(executable.parent_path().parent_path() / "share/photosphere" / relative);
  places.push_back(PHOTOSPHERE_DATA_DIR / relative);
  return places;
}

std::optional<fs::path> findShipped(const fs::path& relative) {
  std::error_code error;
  for (const fs::path& place : shippedPlaces(relative))
    if (fs::exists(place, error)) return place;
  return std::nullopt;
}

}  // namespace photosphere
