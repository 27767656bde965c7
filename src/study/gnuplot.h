#pragma once
// gnuplot, run without a shell.

#include <string>

namespace photosphere::study {

/// Text between single quotes of a gnuplot script: quotes doubled, line breaks and control
/// characters made spaces. Use it with `noenhanced`.
std::string gnuplotText(const std::string& text);

/// What gnuplot prints to standard output for a script.
/// @throws ConfigError naming the package when gnuplot is missing; Error with its words when it
///         fails
std::string runGnuplot(const std::string& script);

}  // namespace photosphere::study
