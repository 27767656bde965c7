// photosphere inspect: the cache doctor.

#include <CLI/CLI.hpp>
#include <memory>

#include "command.h"
#include "photosphere/caches/inspect.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "print.h"

namespace photosphere::cli::plugins {

namespace {

struct InspectArguments {
  std::vector<std::string> files;
  bool json = false;
};

// True when every file could be read.
bool inspectOne(const std::string& path, bool json, std::vector<std::string>& objects) {
  auto deliver = [&](const auto& report) {
    if (json)
      objects.push_back(caches::formatJson(report));
    else
      printLine("{}", caches::formatText(report));
  };
  if (!hasFrameToken(path)) {
    const caches::InspectReport report = caches::inspectCache(path);
    deliver(report);
    return report.error.empty();
  }
  const caches::SequenceReport report = caches::inspectSequence(path);
  deliver(report);
  for (const caches::InspectReport& file : report.files)
    if (!file.error.empty()) return false;
  return true;
}

int runInspect(const InspectArguments& options) {
  std::vector<std::string> objects;
  bool sound = true;
  for (const std::string& path : options.files) {
    throwIfInterrupted();
    if (!inspectOne(path, options.json, objects)) sound = false;
  }
  if (options.json) {
    if (objects.size() == 1)
      printLine("{}", objects.front());
    else
      printLine("[{}]", fmt::join(objects, ",\n"));
  }
  return static_cast<int>(sound ? ExitCode::ok : ExitCode::inputInvalid);
}

std::function<int()> declareInspect(CLI::App& app) {
  auto options = std::make_shared<InspectArguments>();
  app.add_option("FILE", options->files, "Cache files, or patterns such as smoke.####.vdb")
      ->type_name("")
      ->required();
  app.add_flag("--json", options->json, "One JSON object a file, or an array of them");
  return [options] { return runInspect(*options); };
}

}  // namespace

extern const Command inspect;
const Command inspect = {
    "inspect", "Show what caches hold, and what of it will make trouble; exit 4 for a damaged one",
    declareInspect};

}  // namespace photosphere::cli::plugins
