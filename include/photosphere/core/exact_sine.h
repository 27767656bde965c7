#pragma once

namespace photosphere {

/// sin(x) in double for x in [0, pi / 2], by its Taylor series (the 12th term is below 1e-18): the
/// same bits on every CPU, where the C library picks its variant by CPU.
inline double exactSin(double x) {
  double sum = 0;
  for (int n = 23; n > 1; n -= 2)
    sum = (1 + sum) * (-x * x / (n * (n - 1)));
  return x * (1 + sum);
}

}  // namespace photosphere
