#pragma once
// Parallel loops over TBB, and the one setting for the number of threads.

#include <cstddef>
#include <functional>
#include <memory>

namespace photosphere {

/// Threads this process may use: SLURM_CPUS_PER_TASK where set, else its CPU affinity.
unsigned availableThreads();

/// Limits the threads of every loop while it lives. 0 = availableThreads().
class ThreadLimit {
 public:
  explicit ThreadLimit(unsigned threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;
  unsigned threads() const { return m_threads; }

 private:
  struct Impl;
  std::unique_ptr<Impl> m_impl;
  unsigned m_threads;
};

/// Calls body(begin, end) on disjoint ranges that cover [0, count), each of about `grain` items.
/// An exception in a body ends the loop and is rethrown. Ends early with InterruptedError when a
/// signal asks for it.
void parallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t begin, std::size_t end)>& body);

}  // namespace photosphere
