#pragma once
// Errors that end a command. Each kind has one exit code (the table is in the README); `cli`
// catches them once. Nothing throws inside a ray: radiance code counts and marks instead.

#include <stdexcept>
#include <string>

namespace photosphere {

/// Exit codes of the command line, a contract with schedulers and scripts.
enum class ExitCode {
  ok = 0,
  unspecified = 1,
  usage = 2,
  inputMissing = 3,
  inputInvalid = 4,
  memory = 5,
  output = 6,
  accuracy = 7,
  someFramesFailed = 8,
  interruptedResumable = 75,
};

/// Base of all errors that photosphere throws; `what()` is a sentence for the user that names the
/// file or key, the place in it and the remedy.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), m_code(code) {}
  ExitCode code() const { return m_code; }

 private:
  ExitCode m_code;
};

/// Wrong option, scene key or value (exit 2).
class ConfigError : public Error {
 public:
  explicit ConfigError(const std::string& message) : Error(ExitCode::usage, message) {}
};

/// Input that is missing or cannot be opened (exit 3).
class InputMissingError : public Error {
 public:
  InputMissingError(const std::string& path, const std::string& reason)
      : Error(ExitCode::inputMissing, path + ": " + reason) {}
};

/// Input that is there but damaged, or not what it must be (exit 4).
class InputError : public Error {
 public:
  InputError(const std::string& path, const std::string& reason)
      : Error(ExitCode::inputInvalid, path + ": " + reason) {}
};

/// Work that would not fit the memory budget (exit 5).
class MemoryError : public Error {
 public:
  explicit MemoryError(const std::string& message) : Error(ExitCode::memory, message) {}
};

/// Output that could not be written whole (exit 6).
class OutputError : public Error {
 public:
  OutputError(const std::string& path, const std::string& reason)
      : Error(ExitCode::output, path + ": " + reason) {}
};

/// Stopped by a signal before the work was done.
class InterruptedError : public Error {
 public:
  explicit InterruptedError(int signal);
  int signal() const { return m_signal; }

 private:
  int m_signal;
};

}  // namespace photosphere
