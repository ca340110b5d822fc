// Least squares whose equations come point by point, and the search for points that do not fit: what finds a
// camera by reference points.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace zeropose {

// One point at the current estimate: whitened residuals r (k), found minus predicted, and the derivative J (k
// x n) of the whitened prediction by the unknowns.
struct PointRows {
  Eigen::VectorXd r;
  Eigen::MatrixXd J;
};

// A problem with an estimate that can be moved.
class PointEquations {
 public:
  virtual ~PointEquations() = default;
  virtual std::unique_ptr<PointEquations> copy() const = 0;
  virtual Eigen::Index unknowns() const = 0;
  virtual std::size_t points() const = 0;
  virtual Eigen::Index rows_per_point() const = 0;
  // False: the point has no image at the current estimate.
  virtual bool linearise(std::size_t point, PointRows& rows) const = 0;
  // Equations that belong to no point; may append none.
  virtual bool linearise_rest(PointRows& rows) const { return rows.r.resize(0), true; }
  virtual void move(const Eigen::VectorXd& delta) = 0;
};

enum class PointFitStatus { failed = 0, ok, no_image, not_determined, not_converged };

struct PointFit {
  PointFitStatus status = PointFitStatus::failed;
  std::unique_ptr<PointEquations> at;  // the estimate
  double cost = 0;                     // sum of the squared whitened residuals
  Eigen::MatrixXd inverse_N;           // n x n, for residuals of unit variance
  double condition = 0;                // of the normal matrix with a unit diagonal
  int redundancy = 0;                  // equations minus unknowns
};

// Levenberg-Marquardt from the given estimate over the points that are used (one flag for each).
// not_determined: the condition is above 1e13 or there are fewer equations than unknowns.
PointFit fit_points(const PointEquations& start, const std::vector<bool>& used);

struct WrongPointOptions {
  double sigma_px = 0;  // of the residuals before whitening by 1; 0: unknown, estimated from those that fit
  double least_sigma_px = 0.02;  // an estimated sigma is never taken for smaller
  double false_alarm = 1e-3;     // of a whole fit
  int least_redundancy = 2;      // of what is left
};

struct WrongPoints {
  bool agree = false;                 // what is left fits
  std::vector<std::size_t> removed;   // in the order of removal
  std::vector<std::size_t> suspects;  // where they contradict each other and nobody knows which is wrong
  PointFit fit;                       // of what is left
  double sigma_px = 0;                // given, or estimated from what is left; 0: nothing to estimate it from
};

// Takes out points, worst first, until the others agree. A point is wrong when the fit without it is better
// by more than chance allows; it is removed only if no other one explains the contradiction nearly as well
// (likelihood ratio below 1000) and if what is left still checks itself. Precondition: all.status is ok.
WrongPoints remove_wrong_points(PointFit all, std::vector<bool>& used, const WrongPointOptions& options);

// The points agree as well as their noise allows. Without a known noise every fit does: ask whether it is
// much better without one of them.
bool fits_its_noise(const PointFit& fit, const WrongPointOptions& options);

// Whether chance explains that the best of so many fits, each without so many rows that check themselves, is
// so much better than that of all.
bool better_by_chance(const PointFit& all, const PointFit& best, int rows, std::size_t looks,
                      const WrongPointOptions& options);

// Nobody can tell two explanations apart whose costs, in squares of sigma, differ by less: a likelihood ratio
// of 1000.
inline constexpr double undecided_squares = 13.815510557964274;

// Scale of the whitened residuals: given, else from the cost, not below the least; 0 without redundancy.
double sigma_of_fit(const PointFit& fit, const WrongPointOptions& options);

}  // namespace zeropose
