#pragma once
// The only place that includes the TOML parser. Its errors are exceptions, which the scene reader
// turns into ConfigError.

#define TOML_EXCEPTIONS 1
#define TOML_HEADER_ONLY 1
#include <stdexcept>

namespace photosphere::scene {

/// What the parser takes for impossible, and meets in text such as `[[[`.
struct TomlAssertion : std::logic_error {
  using std::logic_error::logic_error;
};

[[noreturn]] inline void throwTomlAssertion(const char* what) {
  throw TomlAssertion(what);
}

}  // namespace photosphere::scene

// In a release it would assume that it holds, else abort.
#define TOML_ASSERT(expr) \
  ((expr) ? static_cast<void>(0) : ::photosphere::scene::throwTomlAssertion(#expr))
#pragma push_macro("NDEBUG")
#undef NDEBUG
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

#include <map>
#include <string>
#include <vector>

namespace photosphere::scene {

/// A parsed file with the command line's overrides applied.
struct TomlText {
  toml::table root;
  std::string name;                         ///< of the file, for messages
  std::map<std::string, std::string> sets;  ///< dotted path of an override to what the user typed

  /// "scene.toml:12: [table]", or "--set path=value: [table]".
  /// @param dotted  path of the node, such as `volume.0.file`
  std::string where(const toml::node& node, const std::string& dotted,
                    const std::string& table) const;
};

/// @throws ConfigError with file, line and column; for a set that is not `path=value`
TomlText parseToml(const std::string& text, const std::string& name,
                   const std::vector<std::string>& sets);

}  // namespace photosphere::scene
