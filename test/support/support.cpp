#include "support/support.h"

#include <fcntl.h>
#include <gtest/gtest-spi.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "photosphere/core/rng.h"

namespace photosphere::test {

namespace fs = std::filesystem;

namespace {
int g_onlyRun = 0;
}

struct RunOnly::Deaf {
  ::testing::TestPartResultArray results;
  ::testing::ScopedFakeTestPartResultReporter reporter{&results};
};

RunOnly::RunOnly() {
  if (!kSanitized) return;
  m_deaf = std::make_unique<Deaf>();
  ++g_onlyRun;
}

RunOnly::~RunOnly() {
  if (kSanitized) --g_onlyRun;
}

std::uint64_t fewer(std::uint64_t count) {
  return g_onlyRun > 0 ? std::max<std::uint64_t>(1, count / 50) : count;
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "photosphere-test-XXXXXX").string();
  if (!mkdtemp(pattern.data())) throw std::runtime_error("mkdtemp failed for " + pattern);
  m_path = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(m_path, ignored);
}

fs::path projectFile(const std::string& relative) {
  return fs::path(PHOTOSPHERE_SOURCE_DIR) / relative;
}
fs::path foreignCache(const std::string& relative) {
  return fs::path(PHOTOSPHERE_FOREIGN_CACHES) / relative;
}

std::string readText(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void writeText(const fs::path& path, const std::string& content) {
  std::ofstream out(path, std::ios::binary);
  out << content;
  if (!out) throw std::runtime_error("cannot write " + path.string());
}

void replaceFloats(const fs::path& path, float from, float to) {
  std::string bytes = readText(path);
  const std::string_view old(reinterpret_cast<const char*>(&from), sizeof from);
  int found = 0;
  for (std::size_t at = 0; (at = bytes.find(old, at)) != std::string::npos;
       at += sizeof to, ++found)
    bytes.replace(at, sizeof to, reinterpret_cast<const char*>(&to), sizeof to);
  EXPECT_GT(found, 0) << path << " holds no " << from;
  writeText(path, bytes);
}

namespace {

RunResult run(const std::vector<std::string>& command, const fs::path& workingFolder) {
  TemporaryFolder folder;
  const fs::path out = folder / "out";
  const fs::path err = folder / "err";
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) {
    const int outFd = open(out.c_str(), O_CREAT | O_WRONLY, 0600);
    const int errFd = open(err.c_str(), O_CREAT | O_WRONLY, 0600);
    dup2(outFd, 1);
    dup2(errFd, 2);
    if (!workingFolder.empty() && chdir(workingFolder.c_str()) != 0) _exit(126);
    std::vector<char*> arguments;
    for (const std::string& word : command)
      arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  int status = 0;
  waitpid(child, &status, 0);
  RunResult result;
  result.exitCode = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  result.out = readText(out);
  result.err = readText(err);
  for (const char* report : {"ERROR: AddressSanitizer", "runtime error: "})
    if (result.err.find(report) != std::string::npos) ADD_FAILURE() << result.err;
  return result;
}

// Regularised incomplete gamma function Q(a, x), by series or continued fraction (Numerical Recipes
// in C, section 6.2, method restated).
double gammaQ(double a, double x) {
  if (x <= 0) return 1.0;
  const double logTerm = -x + a * std::log(x) - std::lgamma(a);
  if (x < a + 1) {
    double sum = 1.0 / a, term = sum;
    for (int n = 1; n < 10000 && term > sum * 1e-16; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return 1.0 - sum * std::exp(logTerm);
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int i = 1; i < 10000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    const double delta = d * c;
    h *= delta;
    if (std::abs(delta - 1) < 1e-15) break;
  }
  return h * std::exp(logTerm);
}

}  // namespace

double chiSquaredTail(double statistic, double degreesOfFreedom) {
  return gammaQ(degreesOfFreedom / 2, statistic / 2);
}

RunResult runTool(const std::vector<std::string>& arguments, const fs::path& workingFolder) {
  std::vector<std::string> command{PHOTOSPHERE_TOOL};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run(command, workingFolder);
}

RunResult runShell(const std::string& command, const fs::path& workingFolder) {
  return run({"/bin/sh", "-c", command}, workingFolder);
}

double directionChiSquared(const std::function<Vec3f(const Vec2f&)>& sample,
                           const std::function<double(const Vec3f&)>& density, int count,
                           std::uint64_t seed) {
  // Cells of equal area in (z, phi): 40 x 40.
  constexpr int rows = 40, columns = 40, fine = 24;
  std::vector<double> observed(rows * columns, 0.0), expected(rows * columns, 0.0);
  Rng rng(RandomKey::fromSeed(seed, 0), RandomStream::test, 0);
  for (int i = 0; i < count; ++i) {
    const Vec3f w = sample(rng.uniform2());
    const int row = std::min(rows - 1, std::max(0, static_cast<int>((1 - w.z) * 0.5f * rows)));
    double turn = std::atan2(w.y, w.x) / (2 * kPi);
    if (turn < 0) turn += 1;
    const int column = std::min(columns - 1, static_cast<int>(turn * columns));
    observed[row * columns + column] += 1;
  }
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      double sum = 0;
      for (int i = 0; i < fine; ++i)
        for (int j = 0; j < fine; ++j) {
          const double z = 1 - 2 * (row + (i + 0.5) / fine) / rows;
          const double phi = 2 * kPi * (column + (j + 0.5) / fine) / columns;
          const double s = std::sqrt(1 - z * z);
          sum += density(Vec3f(s * std::cos(phi), s * std::sin(phi), z));
        }
      expected[row * columns + column] = sum / (fine * fine) * 4 * kPi / (rows * columns) * count;
    }
  double statistic = 0, pooledObserved = 0, pooledExpected = 0;
  int cells = 0;
  for (int i = 0; i < rows * columns; ++i) {
    pooledObserved += observed[i];
    pooledExpected += expected[i];
    if (pooledExpected < 10 && i + 1 < rows * columns) continue;
    if (pooledExpected <= 0) continue;
    const double d = pooledObserved - pooledExpected;
    statistic += d * d / pooledExpected;
    pooledObserved = pooledExpected = 0;
    ++cells;
  }
  return chiSquaredTail(statistic, cells - 1);
}

}  // namespace photosphere::test
