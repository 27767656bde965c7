#include "child.h"

#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "photosphere/core/interrupt.h"
#include "photosphere/core/progress.h"
#include "photosphere/core/resources.h"
#include "photosphere/image/exr.h"

namespace photosphere::study {

namespace {

using nlohmann::json;

json failure(ExitCode code, const std::string& message) {
  return {{"failed", static_cast<int>(code)}, {"message", message}};
}

// All that the child does. It never returns: the parent's objects are not the child's to destroy.
[[noreturn]] void childMain(int out, const std::function<std::string()>& work) {
  setProgressStyle(ProgressStyle::none);
  json answer;
  try {
    answer["text"] = work();
  } catch (const Error& error) {
    answer = failure(error.code(), error.what());
  } catch (const std::bad_alloc&) {
    answer = failure(ExitCode::memory, "out of memory");
  } catch (const std::exception& error) {
    answer = failure(ExitCode::unspecified, error.what());
  }
  const std::string text = answer.dump(-1, ' ', false, json::error_handler_t::replace);
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = write(out, text.data() + written, text.size() - written);
    if (n < 0 && errno != EINTR) _exit(1);
    if (n > 0) written += static_cast<std::size_t>(n);
  }
  _exit(0);
}

// Everything that comes through the pipe. A pending signal is passed on to the child.
std::string readAll(int in, pid_t child) {
  std::string text;
  std::array<char, 65536> buffer{};
  bool told = false;
  while (true) {
    if (pendingSignal() != 0 && !std::exchange(told, true)) kill(child, SIGTERM);
    pollfd wait{in, POLLIN, 0};
    if (poll(&wait, 1, 200) <= 0) continue;
    const ssize_t n = read(in, buffer.data(), buffer.size());
    if (n == 0) return text;
    if (n > 0) text.append(buffer.data(), static_cast<std::size_t>(n));
    if (n < 0 && errno != EINTR) return text;
  }
}

constexpr std::string_view kDeath = "its process ";

std::string endOf(int status) {
  if (WIFSIGNALED(status))
    return fmt::format("{}was ended by signal {} ({})", kDeath, WTERMSIG(status),
                       strsignal(WTERMSIG(status)));
  return fmt::format("{}ended with {} and no answer", kDeath, WEXITSTATUS(status));
}

ChildResult parse(const std::string& text, int status) {
  ChildResult result;
  const json answer = json::parse(text, nullptr, false);
  if (answer.is_object() && answer.contains("text")) {
    result.text = answer["text"].get<std::string>();
    return result;
  }
  result.failed = true;
  result.code = ExitCode::unspecified;
  result.message = endOf(status);
  if (answer.is_object() && answer.contains("failed")) {
    result.code = static_cast<ExitCode>(answer["failed"].get<int>());
    result.message = answer["message"].get<std::string>();
  }
  return result;
}

// The layers that every contender is judged by.
image::Image judgedLayers(const scene::FrameResult& frame) {
  const render::FrameLayers& layers = frame.layers;
  image::Image out(layers.width(), layers.height());
  const std::pair<const char*, const std::vector<Rgb>*> wanted[] = {
      {"", &layers.beauty},
      {"multiple", &layers.multiple},
      {"transmittance", &layers.transmittance}};
  for (const auto& [name, pixels] : wanted) {
    out.addLayer(name, image::ChannelKind::data);
    constexpr std::string_view letters[] = {"R", "G", "B"};
    for (int c = 0; c < 3; ++c) {
      const auto plane =
          out.channel(image::Image::channelName(name, letters[static_cast<std::size_t>(c)]));
      for (std::size_t i = 0; i < pixels->size(); ++i)
        plane[i] = (*pixels)[i][c];
    }
  }
  return out;
}

std::string renderWork(const RenderJob& job) {
  const scene::FrameResult frame = scene::renderScene(job.scene, job.frame, job.request);
  const scene::FrameStatistics& s = frame.statistics;
  image::writeExr(job.image, judgedLayers(frame));
  return json{{"read", s.seconds.read},      {"rasterize", s.seconds.rasterize},
              {"trace", s.seconds.trace},    {"resolve", s.seconds.resolve},
              {"march", s.seconds.march},    {"total", s.seconds.total},
              {"cpu", s.cpuSeconds},         {"memory", s.peakMemoryBytes},
              {"stored", s.photonsStored},   {"capped", s.pathsCapped},
              {"light", s.lightMemoryBytes}, {"error", s.error ? s.error->total() : 0.0}}
      .dump();
}

void limitCpu(double seconds) {
  const auto limit = static_cast<rlim_t>(std::max(1.0, seconds));
  const rlimit both{limit, limit + 1};
  setrlimit(RLIMIT_CPU, &both);
}

std::string factsWork(const scene::SceneFile& scene, std::int64_t frame) {
  const scene::FrameSetup setup = scene::setUpFrame(scene, frame);
  const Vec2i size = setup.camera->resolution();
  const Box3d& b = setup.worldBounds;
  json facts{{"medium", setup.medium->hash()},
             {"width", size.x},
             {"height", size.y},
             {"multiple", setup.effects.multipleScattering},
             {"light_bytes", scene::predictedLightBytes(setup)}};
  if (!b.empty()) facts["bounds"] = {b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z};
  return facts.dump();
}

}  // namespace

bool tellsOfDeath(std::string_view message) {
  return message.starts_with(kDeath);
}

ChildResult runInChild(const std::function<std::string()>& work, double cpuSeconds) {
  throwIfInterrupted();
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0)
    throw Error(ExitCode::unspecified,
                fmt::format("no pipe to a child process: {}", std::strerror(errno)));
  const Stopwatch watch;
  malloc_trim(0);  // what this process no longer uses would count as the child's memory
  const pid_t child = fork();
  if (child < 0) {
    const int why = errno;
    close(ends[0]);
    close(ends[1]);
    throw Error(ExitCode::unspecified,
                fmt::format("cannot start a child process: {}", std::strerror(why)));
  }
  if (child == 0) {
    close(ends[0]);
    if (cpuSeconds > 0) limitCpu(cpuSeconds);
    childMain(ends[1], work);
  }
  close(ends[1]);
  const std::string text = readAll(ends[0], child);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const double seconds = watch.seconds();
  throwIfInterrupted();
  ChildResult result = parse(text, status);
  result.seconds = seconds;
  return result;
}

RenderOutcome renderInChild(const RenderJob& job) {
  const ChildResult child = runInChild([&] { return renderWork(job); });
  RenderOutcome outcome;
  outcome.failed = child.failed;
  outcome.code = child.code;
  outcome.message = child.message;
  if (child.failed) return outcome;
  const json values = json::parse(child.text);
  outcome.seconds.read = values.at("read");
  outcome.seconds.rasterize = values.at("rasterize");
  outcome.seconds.trace = values.at("trace");
  outcome.seconds.resolve = values.at("resolve");
  outcome.seconds.march = values.at("march");
  outcome.seconds.total = values.at("total");
  outcome.cpuSeconds = values.at("cpu");
  outcome.peakMemoryBytes = values.at("memory");
  outcome.photonsStored = values.at("stored");
  outcome.pathsCapped = values.at("capped");
  outcome.lightMemoryBytes = values.at("light");
  outcome.estimatedError = values.at("error");
  return outcome;
}

SceneFacts sceneFacts(const scene::SceneFile& scene, std::int64_t frame) {
  const ChildResult child = runInChild([&] { return factsWork(scene, frame); });
  if (child.failed) throw Error(child.code, child.message);
  const json values = json::parse(child.text);
  SceneFacts facts;
  facts.mediumHash = values.at("medium");
  facts.width = values.at("width");
  facts.height = values.at("height");
  facts.multipleScattering = values.at("multiple");
  facts.lightBytes = values.at("light_bytes");
  if (values.contains("bounds")) {
    const auto b = values.at("bounds").get<std::vector<double>>();
    facts.bounds.grow(Vec3d(b[0], b[1], b[2]));
    facts.bounds.grow(Vec3d(b[3], b[4], b[5]));
  }
  return facts;
}

}  // namespace photosphere::study
