#include "photosphere/core/parallel.h"

#include <sched.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>

#include "photosphere/core/interrupt.h"

#if defined(__SANITIZE_THREAD__)
#define PHOTOSPHERE_TSAN 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define PHOTOSPHERE_TSAN 1
#endif
#endif
#ifdef PHOTOSPHERE_TSAN
extern "C" void __tsan_acquire(void*);
extern "C" void __tsan_release(void*);
#endif

namespace photosphere {

namespace {

// Tells the thread sanitizer what the uninstrumented libtbb keeps from it: that a loop's bodies
// begin after its start, and that its end follows them all, by an exception too. Nothing in other
// builds.
struct LoopEdges {
  LoopEdges() { started(); }
  ~LoopEdges() { finished(); }
  LoopEdges(const LoopEdges&) = delete;
  LoopEdges& operator=(const LoopEdges&) = delete;
#ifdef PHOTOSPHERE_TSAN
  char begin = 0, end = 0;
  void started() {
    __tsan_release(&begin);
  }
  void bodyBegins() {
    __tsan_acquire(&begin);
  }
  void bodyEnds() {
    __tsan_release(&end);
  }
  void finished() {
    __tsan_acquire(&end);
  }
#else
  void started() {}
  void bodyBegins() {}
  void bodyEnds() {}
  void finished() {}
#endif
};

// One body of a loop, from its first instruction to its last, or to what it throws.
class BodyEdges {
 public:
  explicit BodyEdges(LoopEdges& loop) : m_loop(loop) { m_loop.bodyBegins(); }
  ~BodyEdges() { m_loop.bodyEnds(); }
  BodyEdges(const BodyEdges&) = delete;
  BodyEdges& operator=(const BodyEdges&) = delete;

 private:
  LoopEdges& m_loop;
};

}  // namespace

unsigned availableThreads() {
  if (const char* slurm = std::getenv("SLURM_CPUS_PER_TASK")) {
    unsigned value = 0;
    const auto [end, error] = std::from_chars(slurm, slurm + std::strlen(slurm), value);
    if (error == std::errc() && value > 0) return value;
  }
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
  return 1;
}

struct ThreadLimit::Impl {
  explicit Impl(unsigned threads)
      : control(tbb::global_control::max_allowed_parallelism, threads) {}
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(unsigned threads) : m_threads(threads ? threads : availableThreads()) {
  m_impl = std::make_unique<Impl>(m_threads);
}

ThreadLimit::~ThreadLimit() = default;

void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t begin, std::size_t end)>& body) {
  throwIfInterrupted();
  if (count == 0) return;
  const unsigned threads = static_cast<unsigned>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  LoopEdges edges;
  auto loop = [&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, std::max<std::size_t>(1, grain)),
        [&](const tbb::blocked_range<std::size_t>& range) {
          const BodyEdges bodyEdges(edges);
          throwIfInterrupted();
          body(range.begin(), range.end());
        },
        tbb::simple_partitioner());
  };
  // More threads than the machine has cores need an arena of their own; a test of equal bits asks.
  if (static_cast<int>(threads) > tbb::this_task_arena::max_concurrency()) {
    tbb::task_arena arena(static_cast<int>(threads));
    arena.execute(loop);
  } else {
    loop();
  }
}

}  // namespace photosphere
