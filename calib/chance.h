// How likely chance alone makes sums of squared deviations so large.
#pragma once

namespace zeropose {

// P(X > x) for X chi-square with so many degrees of freedom, >= 1; 1 for x <= 0, 0 where x is not finite.
double chi_square_tail(double x, int degrees);

// P(F > x) for Fisher's F with `above` >= 1 and `below` >= 1 degrees above and below the line; 1 for x <= 0.
double fisher_tail(double x, int above, int below);

// By what a covariance whose scale was estimated with so many degrees of freedom must be multiplied so that
// its 95 % ellipsoid in `dimensions` holds the truth in 95 %: dimensions F / chi-square. 1 for very many
// degrees.
double few_data_factor(int dimensions, int degrees);

}  // namespace zeropose
