// The floors of speed: what a frame of the shipped column costs, how fast path tracing scatters,
// and the seconds that photosphere and path tracing each need for one error. Run
//   build/release/test/benchmark_floors --benchmark_repetitions=5
//   --benchmark_report_aggregates_only=true

#include <benchmark/benchmark.h>

#include "photosphere/core/resources.h"
#include "photosphere/volume/vdb_file.h"
#include "support/frames.h"
#include "support/scenes.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

constexpr double kTargetRelMse = 0.02;

estimators::LightFieldLayout greyLayout() {
  estimators::LightFieldLayout layout;
  layout.channels = 1;
  return layout;
}

// Seconds of each stage of a 512 x 512 frame of the column, by photon count.
void columnFrame(benchmark::State& state) {
  const TestScene scene = columnScene(512);
  PhotosphereFrame frame;
  for (auto _ : state)
    frame = renderPhotosphere(scene, greyLayout(), static_cast<std::uint64_t>(state.range(0)), 5);
  state.counters["trace"] = frame.traceSeconds;
  state.counters["resolve"] = frame.resolveSeconds;
  state.counters["march"] = frame.marchSeconds;
  state.counters["peak_MiB"] = static_cast<double>(peakMemoryBytes()) / (1024.0 * 1024.0);
}
BENCHMARK(columnFrame)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Arg(4'000'000)
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

// Scattering events a second, each with its ratio-tracked shadow.
void pathScatterings(benchmark::State& state) {
  const TestScene scene = plumeScene(0.7, 96, 128);
  std::uint64_t scatterings = 0;
  for (auto _ : state)
    scatterings += renderPath(scene, 32, 1).counters.scatterings;
  state.counters["scatterings_per_second"] =
      benchmark::Counter(static_cast<double>(scatterings), benchmark::Counter::kIsRate);
}
BENCHMARK(pathScatterings)->Unit(benchmark::kSecond)->UseRealTime();

const TestScene& plume() {
  static const TestScene scene = plumeScene(0.7, 96, 96);
  return scene;
}
double relMse(const render::FrameLayers& frame) {
  static const Truth truth = pathTruth(plume(), 1024, 101);
  return truth.errorOf(frame, &render::FrameLayers::beauty).relMse;
}

void photosphereToError(benchmark::State& state) {
  PhotosphereFrame frame;
  for (auto _ : state)
    frame = renderPhotosphere(plume(), greyLayout(), static_cast<std::uint64_t>(state.range(0)), 5);
  state.counters["relMSE"] = relMse(frame.layers);
}
BENCHMARK(photosphereToError)
    ->Arg(20'000)
    ->Arg(50'000)
    ->Arg(200'000)
    ->Arg(1'000'000)
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

void pathToError(benchmark::State& state) {
  render::FrameLayers frame;
  Stopwatch watch;
  for (auto _ : state)
    frame = renderPath(plume(), static_cast<int>(state.range(0)), 5);
  const double seconds = watch.seconds() / static_cast<double>(state.iterations());
  const double error = relMse(frame);
  state.counters["relMSE"] = error;
  // It falls as one over the samples.
  state.counters["seconds_to_0.02"] = seconds * error / kTargetRelMse;
}
BENCHMARK(pathToError)->Arg(16)->Arg(64)->Arg(256)->Unit(benchmark::kSecond)->UseRealTime();

}  // namespace

}  // namespace photosphere::test

BENCHMARK_MAIN();
