#pragma once
// Option rows that several phase functions share.

#include "photosphere/phase/phase.h"

namespace photosphere::phase {

/// A mean cosine; whoever is made of it refuses the ends.
constexpr Param cosineRow(std::string_view name, std::string_view defaultText,
                          std::string_view help) {
  return {
      .name = name, .unit = "", .defaultText = defaultText, .help = help, .min = -1.0, .max = 1.0};
}

}  // namespace photosphere::phase
