// A height as a smooth function of a radius: a cubic spline with knots at equal distances, by least squares.
// Internal to the room.
#pragma once

#include <Eigen/Core>
#include <span>

namespace zeropose {

struct ProfileSample {
  double radius_mm = 0, height_mm = 0, sigma_mm = 1;
};

struct ProfileHeight {
  double height_mm = 0, slope = 0, bend_per_mm = 0;
  double sigma_mm = 0;  // of the height
};

// The weights of the four coefficients that a place depends on, and their first two derivatives.
struct SplineWeights {
  Eigen::Index first = 0;
  Eigen::Vector4d value, slope, bend;
};

class SplineKnots {
 public:
  // Precondition: from < to, 0 < spacing.
  SplineKnots(double from_mm, double to_mm, double spacing_mm);
  Eigen::Index coefficients() const { return count_; }
  // Beyond the ends the last piece goes on.
  SplineWeights at(double radius_mm) const;

 private:
  double from_mm_, spacing_mm_;
  Eigen::Index count_;
};

// A weak pull towards even coefficients, so that pieces without samples stay determined: added to the normal
// matrix, `strength` times its mean diagonal.
void even_out(Eigen::MatrixXd& normal, Eigen::Index coefficients, double strength = 1e-6);

class ProfileSpline {
 public:
  // gain: see neighbours_gain(). Sigmas are made larger where the samples scatter more than theirs say:
  // by the median of their residuals, so that letters, which no such spline follows, do not count.
  // Precondition: at least one sample more than coefficients, sigmas above 0.
  ProfileSpline(std::span<const ProfileSample> samples, const SplineKnots& knots, double gain);
  ProfileHeight at(double radius_mm) const;
  double scatter() const { return scatter_; }  // of the residuals over their sigmas, by their median

 private:
  SplineKnots knots_;
  Eigen::VectorXd coefficients_;
  Eigen::MatrixXd covariance_;
  double scatter_ = 0;
};

}  // namespace zeropose
