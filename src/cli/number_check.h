#pragma once
// What options that are numbers take.

#include <CLI/CLI.hpp>
#include <limits>

namespace photosphere::cli {

/// Bounds of a number, inside those of finite ones.
struct NumberBounds {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool positive = false;  ///< above 0
};

/// For CLI::Option::check: refuses what is no finite number, or outside the bounds. CLI11's own
/// ranges let NaN pass, as it is not less than any bound.
CLI::Validator finiteNumber(const NumberBounds& bounds = {});

/// For unsigned options, as CLI11 takes a negative number for another one: refuses what is no whole
/// number of at least 0 that 64 bits hold.
CLI::Validator countingNumber();

/// For signed options, as CLI11 takes the nearest number for one that 64 bits do not hold: refuses
/// that, and what is no whole number.
CLI::Validator wholeNumber();

/// The same for frames and what is added to them: up to a billion.
CLI::Validator frameNumber();

}  // namespace photosphere::cli
