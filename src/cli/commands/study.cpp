// photosphere study: not served yet.

#include "command.h"
#include "unserved.h"

namespace photosphere::cli::plugins {

extern const Command study;
const Command study = {
    "study", "Measure error against time over estimators and settings (not served yet)",
    [](CLI::App& app) {
      return declareUnserved(app, "study", "render with -s/--set and compare the images");
    }};

}  // namespace photosphere::cli::plugins
