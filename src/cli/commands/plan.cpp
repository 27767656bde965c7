// photosphere plan: not served yet.

#include "command.h"
#include "unserved.h"

namespace photosphere::cli::plugins {

extern const Command plan;
const Command plan = {
    "plan", "Say which effects a scene calls for, and what they cost (not served yet)",
    [](CLI::App& app) {
      return declareUnserved(app, "plan",
                             "render --dry-run prints the choices that a render would make");
    }};

}  // namespace photosphere::cli::plugins
