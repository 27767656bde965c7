#include <cstdio>
#include <string>
#include <vector>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/version.h"
#include "photosphere/scene/scene_file.h"

// Calls a low module, a plug-in table (which a linker could drop) and the highest library module.
int main() {
  const std::vector<std::int64_t> frames = photosphere::parseFrames("1-9x4");
  const auto formats = photosphere::caches::cacheFormats();
  const auto rows = photosphere::scene::sceneParams();
  std::printf("%s, %zu frames, %zu formats, %zu scene keys\n", photosphere::versionText().c_str(),
              frames.size(), formats.size(), rows.size());
  return frames == std::vector<std::int64_t>{1, 5, 9} && formats.size() >= 5 && !rows.empty() ? 0
                                                                                              : 1;
}
