#include <cstdio>
#include <string>
#include <vector>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/version.h"
#include "photosphere/image/preview.h"
#include "photosphere/scene/scene_file.h"

// Calls a low module, a plug-in table (which a linker could drop), the highest library module and
// what loads a library of its own.
int main() {
  const std::vector<std::int64_t> frames = photosphere::parseFrames("1-9x4");
  const auto formats = photosphere::caches::cacheFormats();
  const auto rows = photosphere::scene::sceneParams();
  const std::vector<float> grey(3, 0.5f);
  const std::string png = photosphere::image::encodePng(1, 1, grey);
  std::printf("%s, %zu frames, %zu formats, %zu scene keys, a PNG of %zu bytes\n",
              photosphere::versionText().c_str(), frames.size(), formats.size(), rows.size(),
              png.size());
  const bool right = frames == std::vector<std::int64_t>{1, 5, 9} && formats.size() >= 5 &&
                     !rows.empty() && png.starts_with("\x89PNG");
  return right ? 0 : 1;
}
