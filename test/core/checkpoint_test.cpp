#include "photosphere/core/checkpoint.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>

#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

namespace fs = std::filesystem;

WriteState number(int value) {
  return [value](StateWriter& w) {
    w.value(value);
    w.value(std::vector<double>{0.5, 0.25});
    w.text("so far");
  };
}

class CheckpointTest : public testing::Test {
 protected:
  Checkpoint begin(Resume resume = Resume::automatic, const std::string& work = "work") {
    Checkpoint checkpoint(m_folder / "out.exr.checkpoint", 1e9, resume);
    checkpoint.identify(work);
    return checkpoint;
  }
  std::optional<int> kept(Checkpoint checkpoint) {
    auto reader = checkpoint.load("frame");
    return reader ? std::optional(reader->value<int>()) : std::nullopt;
  }
  TemporaryFolder m_folder;
};

TEST_F(CheckpointTest, GivesBackWhatWasKept) {
  EXPECT_EQ(Checkpoint::folderOf("a/b.exr"), fs::path("a/b.exr.checkpoint"));
  begin().save("frame", number(7));
  Checkpoint again = begin();
  auto reader = again.load("frame");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->value<int>(), 7);
  std::vector<double> values;
  reader->value(values);
  EXPECT_EQ(values, (std::vector<double>{0.5, 0.25}));
  EXPECT_EQ(reader->text(), "so far");
  EXPECT_TRUE(reader->atEnd());
  EXPECT_THROW(reader->value<int>(), InputError);
  EXPECT_FALSE(again.load("light"));
  again.discard();
  EXPECT_FALSE(fs::exists(m_folder / "out.exr.checkpoint"));
}

TEST_F(CheckpointTest, OtherWorkIsNotGoneOnFrom) {
  begin().save("frame", number(7));
  EXPECT_THROW(begin(Resume::require, "other"), InputError);
  EXPECT_EQ(kept(begin()), 7);
  EXPECT_FALSE(kept(begin(Resume::automatic, "other")));
  EXPECT_FALSE(kept(begin())) << "what is not gone on from is dropped";
  begin().save("frame", number(8));
  EXPECT_FALSE(kept(begin(Resume::never)));
}

TEST_F(CheckpointTest, DamageIsNoticed) {
  begin().save("frame", number(7));
  const fs::path file = m_folder / "out.exr.checkpoint" / "frame";
  const std::string whole = readText(file);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string hurt = whole;
    hurt[i] = static_cast<char>(hurt[i] ^ 0x10);
    std::ofstream(file, std::ios::binary) << hurt;
    EXPECT_THROW(begin(Resume::require), InputError) << "byte " << i;
    std::ofstream(file, std::ios::binary) << whole.substr(0, i);
    EXPECT_THROW(begin(Resume::require), InputError) << "cut at " << i;
  }
  EXPECT_FALSE(kept(begin()));
}

// A kill in the middle of writing leaves a temporary beside the last whole file.
TEST_F(CheckpointTest, AnUnfinishedWriteIsCleanedAway) {
  begin().save("frame", number(7));
  const fs::path left = m_folder / "out.exr.checkpoint" / ".frame.tmp-photosphere-1";
  writeText(left, "half");
  EXPECT_EQ(kept(begin()), 7);
  EXPECT_FALSE(fs::exists(left));
}

TEST_F(CheckpointTest, ANoteIsKeptWithTheFirstPart) {
  const fs::path folder = m_folder / "out.exr.checkpoint";
  EXPECT_FALSE(Checkpoint::note(folder));
  Checkpoint checkpoint = begin();
  checkpoint.noteAlong("frames 1-3");
  EXPECT_FALSE(Checkpoint::note(folder));
  checkpoint.save("frame", number(7));
  EXPECT_EQ(Checkpoint::note(folder), "frames 1-3");
}

// What cannot be kept does not end the work.
TEST_F(CheckpointTest, AFolderThatCannotBeWrittenIsAWarning) {
  writeText(m_folder / "out.exr.checkpoint", "a file");
  EXPECT_NO_THROW(begin().save("frame", number(7)));
  begin().discard();
  EXPECT_EQ(readText(m_folder / "out.exr.checkpoint"), "a file");
}

TEST_F(CheckpointTest, WhatOthersKeepThereStays) {
  const fs::path folder = m_folder / "out.exr.checkpoint";
  fs::create_directories(folder / "takes");
  writeText(folder / "notes.txt", "mine");
  writeText(folder / ".hidden", "mine too");
  Checkpoint checkpoint = begin();
  checkpoint.save("frame", number(7));
  EXPECT_EQ(kept(begin()), 7);
  checkpoint.discard();
  EXPECT_FALSE(fs::exists(folder / "frame"));
  for (const char* name : {"takes", "notes.txt", ".hidden"})
    EXPECT_TRUE(fs::exists(folder / name)) << name;
}

TEST_F(CheckpointTest, OffersAreTakenByTime) {
  Checkpoint rare = begin();
  rare.offer("frame", number(1));
  EXPECT_FALSE(kept(begin()));
  Checkpoint often(m_folder / "out.exr.checkpoint", 0.0, Resume::automatic);
  often.identify("work");
  often.offer("frame", number(2));
  EXPECT_EQ(kept(begin()), 2);
}

// In a process of its own: a signal that is pending stays so.
TEST_F(CheckpointTest, ASignalKeepsAndEndsTheWork) {
  const auto work = [&] {
    installSignalHandlers();
    raise(SIGTERM);
    {
      const InterruptDelay delay;
      throwIfInterrupted();
      Checkpoint checkpoint = begin();
      try {
        checkpoint.offer("frame", number(9));
      } catch (const InterruptedError& stopped) {
        if (stopped.signal() != SIGTERM) _exit(1);
        try {
          throwIfInterrupted();
        } catch (const InterruptedError&) {
          _exit(2);
        }
      }
    }
    try {
      throwIfInterrupted();
    } catch (const InterruptedError&) {
      _exit(kept(begin()) == 9 ? 0 : 3);
    }
    _exit(4);
  };
  EXPECT_EXIT(work(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace photosphere::test
