#include "number_check.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdint>

namespace photosphere::cli {

namespace {

std::string describe(const NumberBounds& bounds) {
  if (bounds.positive) return " above 0";
  if (std::isfinite(bounds.least) && std::isfinite(bounds.most))
    return fmt::format(" from {} to {}", bounds.least, bounds.most);
  return std::isfinite(bounds.least) ? fmt::format(" of at least {}", bounds.least) : "";
}

template <class Whole>
CLI::Validator ofType(const char* range, Whole least = std::numeric_limits<Whole>::min(),
                      Whole most = std::numeric_limits<Whole>::max()) {
  return {[range, least, most](std::string& text) -> std::string {
            Whole value = 0;
            const char* const end = text.data() + text.size();
            const auto [next, error] = std::from_chars(text.data(), end, value);
            if (error == std::errc() && next == end && value >= least && value <= most) return {};
            return fmt::format("must be a whole number {}, not '{}'", range, text);
          },
          ""};
}

}  // namespace

CLI::Validator finiteNumber(const NumberBounds& bounds) {
  return {[bounds](std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && std::isfinite(value) &&
                value >= bounds.least && value <= bounds.most && (!bounds.positive || value > 0))
              return {};
            return fmt::format("must be a finite number{}, not '{}'", describe(bounds), text);
          },
          ""};
}

CLI::Validator countingNumber() {
  return ofType<std::uint64_t>("of at least 0");
}

CLI::Validator frameNumber() {
  constexpr std::int64_t most = 1'000'000'000;
  return ofType<std::int64_t>("from minus to plus a billion", -most, most);
}

CLI::Validator wholeNumber() {
  return ofType<std::int64_t>("from -2^63 to 2^63 - 1");
}

}  // namespace photosphere::cli
