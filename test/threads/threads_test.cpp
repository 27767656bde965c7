// What threads share: sums, loops, limits, tables that are filled as they are read. Small enough to
// run under the thread sanitizer, for which this program is built from core and sphere alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <thread>
#include <vector>

#include "photosphere/core/fixed_point.h"
#include "photosphere/core/log.h"
#include "photosphere/core/parallel.h"
#include "photosphere/sphere/bin_weights.h"

namespace photosphere {
namespace {

constexpr std::size_t kItems = 20'000;

TEST(Threads, SumsThatManyThreadsAddToLoseNothing) {
  std::vector<std::int64_t> sums(7, 0);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (std::size_t i = 0; i < kItems; ++i)
        addChecked(sums[i % sums.size()], static_cast<std::int64_t>(i));
    });
  for (std::thread& thread : threads)
    thread.join();
  std::int64_t total = 0;
  for (const std::int64_t sum : sums)
    total += sum;
  EXPECT_EQ(total, static_cast<std::int64_t>(4 * (kItems * (kItems - 1) / 2)));
}

// Rows of sums, added whole under a lock, of which few serve many rows.
TEST(Threads, RowsThatManyThreadsAddToLoseNothing) {
  constexpr std::size_t kRows = 3, kWide = 100;
  FixedSums sums;
  sums.sums.assign(kRows * kWide, 0);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      std::vector<std::int64_t> row(kWide);
      for (std::size_t i = 0; i < kItems; ++i) {
        for (std::size_t k = 0; k < kWide; ++k)
          row[k] = k % 2 ? -static_cast<std::int64_t>(k) : static_cast<std::int64_t>(k);
        sums.addRow(i % kRows * kWide, row);
      }
    });
  for (std::thread& thread : threads)
    thread.join();
  for (std::size_t r = 0; r < kRows; ++r) {
    const auto times = static_cast<std::int64_t>(4 * ((kItems + kRows - 1 - r) / kRows));
    for (std::size_t k = 0; k < kWide; ++k)
      ASSERT_EQ(sums.sums[r * kWide + k],
                times * (k % 2 ? -static_cast<std::int64_t>(k) : static_cast<std::int64_t>(k)));
  }
  EXPECT_EQ(sums.overflows, 0u);
}

// A row counts what leaves the range of its sums, as single sums do.
TEST(Threads, RowsCountWhatOverflows) {
  FixedSums sums;
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  sums.sums = {kMost - 1, -kMost, 5};
  sums.addRow(0, std::vector<std::int64_t>{1, -1, 1});
  EXPECT_EQ(sums.overflows, 0u);
  sums.addRow(0, std::vector<std::int64_t>{1, -1, 1});
  EXPECT_EQ(sums.overflows, 2u);
  EXPECT_EQ(sums.sums[2], 7);
}

TEST(Threads, LoopVisitsEveryItemOnceAndItsWritesAreSeenAfterIt) {
  const ThreadLimit limit(4);
  std::vector<int> visits(kItems, 0);  // plain ints: ranges are disjoint, the loop's end joins them
  for (int round = 1; round <= 20; ++round) {
    parallelFor(kItems, 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        ++visits[i];
    });
    for (std::size_t i = 0; i < kItems; ++i)
      ASSERT_EQ(visits[i], round) << i;
  }
}

TEST(Threads, LoopsInsideLoopsJoinToo) {
  const ThreadLimit limit(4);
  std::vector<std::int64_t> sums(16, 0);
  parallelFor(sums.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      parallelFor(1000, 50, [&, i](std::size_t from, std::size_t to) {
        addChecked(sums[i], static_cast<std::int64_t>(to - from));
      });
  });
  for (const std::int64_t sum : sums)
    EXPECT_EQ(sum, 1000);
}

// What the other bodies did before the loop was left may be read, and what they used be gone.
TEST(Threads, AnExceptionInALoopReachesTheCaller) {
  const ThreadLimit limit(4);
  for (int round = 0; round < 200; ++round) {
    std::vector<int> visits(kItems, 0);
    EXPECT_THROW(parallelFor(kItems, 16,
                             [&](std::size_t begin, std::size_t end) {
                               for (std::size_t i = begin; i < end; ++i)
                                 ++visits[i];
                               if (begin <= kItems / 2 && kItems / 2 < end)
                                 throw std::runtime_error("stop");
                             }),
                 std::runtime_error);
    EXPECT_EQ(visits[kItems / 2], 1) << round;
    EXPECT_LE(*std::max_element(visits.begin(), visits.end()), 1) << round;
  }
}

// Whoever asks for a direction first has its weights computed, and all read the same.
TEST(Threads, WeightsThatManyThreadsAskForAreTheSame) {
  const auto phase = [](const Vec3f& w, const Vec3f& wo) {
    const double q = 1.25 - static_cast<double>(glm::dot(w, wo));
    return 0.75 / (4 * kPi * q * std::sqrt(q));  // g = 1/2
  };
  const sphere::BinShares nearest{sphere::Partition(1)};
  constexpr auto kSmooth = sphere::Reconstruction::smooth;
  const auto read = [](const sphere::BinWeights& table, bool backwards) {
    constexpr int kDirections = 60;
    std::vector<float> all(kDirections * static_cast<std::size_t>(table.size()));
    for (int i = 0; i < kDirections; ++i) {
      const int k = backwards ? kDirections - 1 - i : i;
      const Vec3f wo = glm::normalize(Vec3f(static_cast<float>(k), 20.0f, 35.0f));
      table.weights(wo, &all[static_cast<std::size_t>(k * table.size())]);
    }
    return all;
  };
  const std::vector<float> alone = read({nearest, phase, 0.5, kSmooth}, false);
  for (int round = 0; round < 20; ++round) {
    const sphere::BinWeights table(nearest, phase, 0.5, kSmooth);
    std::vector<std::vector<float>> found(4);
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < found.size(); ++t)
      threads.emplace_back([&, t] { found[t] = read(table, t % 2 == 1); });
    for (std::thread& thread : threads)
      thread.join();
    for (const std::vector<float>& weights : found)
      ASSERT_EQ(weights, alone) << round;
  }
}

TEST(Threads, LogLevelsMayChangeWhileOthersLog) {
  const log::Level before = log::level();
  log::setLevel(log::Level::error);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([] {
      for (int i = 0; i < 1000; ++i) {
        log::setLevel(log::Level::error);
        log::info("nobody sees this {}", i);
      }
    });
  for (std::thread& thread : threads)
    thread.join();
  EXPECT_EQ(log::level(), log::Level::error);
  log::setLevel(before);
}

// Run by its own CTest entry, which expects the thread sanitizer to object.
TEST(Threads, DISABLED_PlantedRace) {
  const ThreadLimit limit(4);
  volatile std::int64_t sum = 0;
  parallelFor(kItems, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      sum = sum + 1;
  });
  SUCCEED() << sum;
}

}  // namespace
}  // namespace photosphere
