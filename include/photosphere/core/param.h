#pragma once
// Options as rows. One row serves the scene parser, --help, `photosphere list` and the EXR header.

#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere {

enum class ParamType {
  boolean,
  integer,
  real,
  text,    ///< free text, a path, or one of `choices`
  rgb,     ///< number or [r, g, b]
  vec2,    ///< [x, y]
  vec3,    ///< [x, y, z]
  matrix,  ///< 16 numbers, row-major, column vectors
  list,    ///< array of text, or of some of `choices`
};

/// One option. All text is constant and in English; `unit` is empty for pure numbers.
struct Param {
  std::string_view name;
  ParamType type = ParamType::real;
  std::string_view unit = {};
  std::string_view defaultText =
      {};  ///< as in a scene file, without quotes: `1.0`, `[0, 0, 5]`, `true`
  std::string_view help = {};
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  std::string_view choices = {};   ///< `a|b|c`, of a list its items'; empty = free
  std::string_view unserved = {};  ///< choices known to the contract that this version lacks
  bool served = true;  ///< false: any value but the default is refused as not served yet
};

using ParamValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>,
                                std::vector<std::string>>;

/// Values for a set of rows; what was not given has the row's default.
class ParamValues {
 public:
  ParamValues() = default;
  explicit ParamValues(std::span<const Param> rows);

  /// Sets a value after checking type, range and choices.
  /// @param where  "file:line: [table]" or "--option", begins the message
  /// @throws ConfigError
  void set(std::string_view name, ParamValue value, const std::string& where);
  /// Sets from text as given on a command line. @throws ConfigError
  void setText(std::string_view name, std::string_view text, const std::string& where);

  bool given(std::string_view name) const;
  bool flag(std::string_view name) const;
  std::int64_t integer(std::string_view name) const;
  double real(std::string_view name) const;
  const std::string& text(std::string_view name) const;
  Vec2d vec2(std::string_view name) const;
  Vec3d vec3(std::string_view name) const;
  Rgb rgb(std::string_view name) const;
  Mat4d matrix(std::string_view name) const;  ///< column-major GLM matrix of the row-major text
  std::vector<std::string> list(std::string_view name) const;

  std::span<const Param> rows() const { return m_rows; }
  /// The value in scene-file syntax (TOML).
  std::string format(std::string_view name) const;

 private:
  const ParamValue& value(std::string_view name) const;

  std::vector<Param> m_rows;
  std::map<std::string, ParamValue, std::less<>> m_values;
  std::map<std::string, bool, std::less<>> m_given;
};

/// Reads a value of a row's type from text. @throws ConfigError
ParamValue parseParam(const Param& row, std::string_view text, const std::string& where);

/// The known name closest to a misspelt one, as `; did you mean 'x'?`, or an empty string.
std::string suggestion(std::string_view name, std::span<const std::string_view> known);

/// A table of rows for a terminal: name, type and unit, default, range or choices, help.
std::string formatParams(std::span<const Param> rows, int indent);

}  // namespace photosphere
