#pragma once
// Checkpoints: what long work has done so far, kept on disk so that the same work can go on after a
// signal, a kill or a power cut, to the same bits.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace photosphere {

/// Values one after another as bytes of this machine: single ones, and vectors with their size.
/// What names the members of a state once can write it and read it, as StateReader has the same
/// calls. A checkpoint is read by the build that wrote it, so there is no other form to agree on.
class StateWriter {
 public:
  virtual ~StateWriter() = default;
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void value(const T& v) { put(&v, sizeof v); }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void value(const std::vector<T>& v) {
    value(static_cast<std::uint64_t>(v.size()));
    put(v.data(), v.size() * sizeof(T));
  }
  void text(std::string_view s) {
    value(static_cast<std::uint64_t>(s.size()));
    put(s.data(), s.size());
  }

 protected:
  virtual void put(const void* data, std::size_t size) = 0;
};

/// Reads back what a StateWriter wrote, in the same order, from a file that was found unhurt.
/// @throws InputError naming the file where it ends early
class StateReader {
 public:
  StateReader(std::filesystem::path file, std::ifstream in, std::uint64_t bytes)
      : m_file(std::move(file)), m_in(std::move(in)), m_left(bytes) {}
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void value(T& v) { get(&v, 1, sizeof v); }
  template <class T>
  T value() {
    T v{};
    value(v);
    return v;
  }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void value(std::vector<T>& v) {
    const auto count = value<std::uint64_t>();
    if (count > m_left / sizeof(T)) fail();
    v.resize(static_cast<std::size_t>(count));
    get(v.data(), count, sizeof(T));
  }
  std::string text();
  bool atEnd() const { return m_left == 0; }
  [[noreturn]] void fail() const;

 private:
  void get(void* to, std::uint64_t count, std::size_t size);

  std::filesystem::path m_file;
  std::ifstream m_in;
  std::uint64_t m_left;
};

/// Says all that is done of some work.
using WriteState = std::function<void(StateWriter&)>;
/// What long work calls wherever all that it has done can be said. It may keep that, and ends the
/// work by InterruptedError when a signal asked for it. Empty = nobody keeps anything.
using PausePoint = std::function<void(const WriteState&)>;

/// When work goes on from a checkpoint.
enum class Resume {
  automatic,  ///< where there is one of the same work; another is left behind, with a warning
  never,      ///< what is there is dropped
  require,    ///< it is an error if there is none of the same work
};

/// The checkpoint of one output: a folder beside it, with a file for each part of the work. Every
/// file is written whole or not at all, and read only if it is unhurt and of the same work.
class Checkpoint {
 public:
  /// The folder of an output's checkpoint: its path and `.checkpoint`.
  static std::filesystem::path folderOf(const std::filesystem::path& output);

  /// @param interval  seconds between periodic saves, at least; more where saving is slow
  Checkpoint(std::filesystem::path folder, double interval, Resume resume);

  /// Names the work: files of another are not gone on from. Must be called before `load` and
  /// `offer`.
  /// @throws InputError (Resume::require) when the folder holds the checkpoint of other work
  void identify(const std::string& work);

  /// What an earlier run kept under that name; nothing where there is none.
  std::optional<StateReader> load(const std::string& part);

  /// Keeps a part: when a signal is pending, after which InterruptedError is thrown, or when the
  /// last save of any part is long enough ago.
  void offer(const std::string& part, const WriteState& write);
  /// Keeps a part now. What cannot be written is a warning: the work itself is not hurt.
  void save(const std::string& part, const WriteState& write);
  /// Text to be kept beside the first part that is saved; see `note`.
  void noteAlong(std::string text) { m_note = std::move(text); }
  /// Keeps that text now, where it is not kept yet.
  void saveNote();
  /// The text that an earlier run kept, or nothing.
  static std::optional<std::string> note(const std::filesystem::path& folder);

  /// Whether a folder holds what a run kept.
  static bool isIn(const std::filesystem::path& folder);
  /// True once something was kept or found that a further run can go on from.
  bool exists() const { return isIn(m_folder); }
  const std::filesystem::path& folder() const { return m_folder; }
  /// The work is done: removes what was kept, and the folder unless it holds something else.
  void discard();

 private:
  using Clock = std::chrono::steady_clock;
  std::filesystem::path fileOf(const std::string& part) const;

  std::filesystem::path m_folder;
  double m_interval;
  Resume m_resume;
  std::string m_work, m_note;
  bool m_warned = false, m_noteKept = false;
  Clock::time_point m_last = Clock::now();
  double m_saveSeconds = 0;
};

}  // namespace photosphere
