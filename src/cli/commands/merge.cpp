// photosphere merge: not served yet.

#include "command.h"
#include "unserved.h"

namespace photosphere::cli::plugins {

extern const Command merge;
const Command merge = {
    "merge", "Sum the shards of a light cache (not served yet)", [](CLI::App& app) {
      return declareUnserved(app, "merge", "trace the light cache in one process");
    }};

}  // namespace photosphere::cli::plugins
