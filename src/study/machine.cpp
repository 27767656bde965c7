#include "machine.h"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <fstream>

#include "photosphere/core/error.h"
#include "photosphere/core/version.h"
#include "photosphere/image/exr_attributes.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

std::string machineName() {
  std::ifstream info("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(info, line))
    if (line.rfind("model name", 0) == 0 && line.find(':') != std::string::npos) {
      model = line.substr(line.find(':') + 2);
      break;
    }
  utsname system = {};
  uname(&system);
  return fmt::format("{}, {} {}", model, system.sysname, system.release);
}

}  // namespace

void describeRun(const StudyOptions& options, RunFacts& facts) {
  facts.version = versionText();
  facts.machine = machineName();
  facts.date = image::currentCapDate();
  facts.threads = options.threads;
  facts.quick = options.quick;
}

RunFolder::RunFolder(fs::path path) : m_path(std::move(path)) {
  std::error_code error;
  fs::create_directories(m_path, error);
  if (error) throw OutputError(m_path.string(), "cannot create this folder: " + error.message());
}

RunFolder::~RunFolder() {
  std::error_code ignored;
  fs::remove_all(m_path, ignored);
}

}  // namespace photosphere::study
