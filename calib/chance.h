// How likely chance alone makes sums of squared deviations so large.
#pragma once

namespace zeropose {

// P(X > x) for X chi-square with so many degrees of freedom, >= 1; 1 for x <= 0, 0 where x is not finite.
double chi_square_tail(double x, int degrees);

// P(F > x) for Fisher's F with 2 or 4 degrees above and `below` >= 1 below the line; 1 for x <= 0.
double fisher_tail(double x, int above, int below);

}  // namespace zeropose
