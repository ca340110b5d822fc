// Families of outlines with straight edges under blur: how much of the background each pixel shows, and its
// derivatives. Internal to the room.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace zeropose {

inline constexpr int most_shape_parameters = 7;
inline constexpr std::size_t contour_block = 16;
using ShapeParameters = Eigen::Matrix<double, most_shape_parameters, 1>;

// Some pixels side by side. Coordinates in px from the origin that the parameters refer to.
struct ContourBlock {
  alignas(64) float x[contour_block], y[contour_block];
  alignas(64) float cover[contour_block];                            // share of the background, 0..1
  alignas(64) float by_shape[most_shape_parameters][contour_block];  // its derivatives
  alignas(64) float by_blur[contour_block];
};

// Where a pixel lies relative to the outline. Stretches are pieces of the outline of about stretch_px.
struct ContourPlace {
  float distance_px = 0;  // positive in the background
  int stretch = -1;       // -1: beyond the ends of the outline
};
inline constexpr double stretch_px = 4;

class ContourShape {
 public:
  virtual ~ContourShape() = default;

  virtual int size() const = 0;          // parameters in use; the rest stay 0
  virtual int translations() const = 0;  // how many of the first ones move the outline, px
  virtual int stretches() const = 0;
  virtual bool plausible(const ShapeParameters& at) const = 0;

  // Columns of row y that hold all its pixels within reach_px of the outline; empty when to < from.
  struct Reach {
    double from = 0, to = -1;
  };
  virtual Reach reach_of_row(const ShapeParameters& at, double y, double reach_px) const;

  // Pixels (x0 + i, y).
  virtual void place_row(const ShapeParameters& at, double x0, double y,
                         std::span<ContourPlace> row) const = 0;

  // Fills cover and the derivatives from x and y.
  virtual void evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const = 0;

  // The longest way, px, that a point of the outline goes from one set of parameters to the other (about).
  virtual double movement_px(const ShapeParameters& from, const ShapeParameters& to) const = 0;

 private:
  virtual double radius_px(
      const ShapeParameters& at) const = 0;  // of the outline about its first two parameters
};

// A straight edge. Parameters: offset (px) and direction (rad) of the normal that points from the mark's side
// (dark) into the background's. Runs from t0 to t1 (px) along (-sin, cos) of the direction.
class EdgeShape final : public ContourShape {
 public:
  EdgeShape(double t0, double t1);
  int size() const override { return 2; }
  int translations() const override { return 1; }
  int stretches() const override { return stretches_; }
  bool plausible(const ShapeParameters&) const override { return true; }
  void place_row(const ShapeParameters& at, double x0, double y, std::span<ContourPlace> row) const override;
  void evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const override;
  double movement_px(const ShapeParameters& from, const ShapeParameters& to) const override;
  Reach reach_of_row(const ShapeParameters& at, double y, double reach_px) const override;

 private:
  double radius_px(const ShapeParameters&) const override { return 0; }

  double t0_, t1_;
  int stretches_;
};

// Two edges that meet. Parameters: the point (px), directions of the arms away from it (rad). The mark lies
// between the first arm and the second one, from the first by growing angle, less than pi further.
class CornerShape final : public ContourShape {
 public:
  CornerShape(double first_px, double second_px);  // lengths of the arms
  int size() const override { return 4; }
  int translations() const override { return 2; }
  int stretches() const override { return count_[0] + count_[1] + 1; }  // the last one is the tip
  bool plausible(const ShapeParameters& at) const override;
  void place_row(const ShapeParameters& at, double x0, double y, std::span<ContourPlace> row) const override;
  void evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const override;
  double movement_px(const ShapeParameters& from, const ShapeParameters& to) const override;

 private:
  double radius_px(const ShapeParameters& at) const override;

  std::array<double, 2> length_;
  std::array<int, 2> count_;
};

// An affine image of a long hole. Parameters: centre (px), then row by row the matrix M (1/px) that carries
// an offset from the centre to the plane where the caps are unit circles and the long axis is the first one,
// then half the distance of the caps' centres there.
class SlotShape final : public ContourShape {
 public:
  explicit SlotShape(const ShapeParameters& about);  // counts the stretches
  int size() const override { return 7; }
  int translations() const override { return 2; }
  int stretches() const override { return 2 * (straight_ + cap_); }
  bool plausible(const ShapeParameters& at) const override;
  void place_row(const ShapeParameters& at, double x0, double y, std::span<ContourPlace> row) const override;
  void evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const override;
  double movement_px(const ShapeParameters& from, const ShapeParameters& to) const override;

 private:
  double radius_px(const ShapeParameters& at) const override;

  int straight_, cap_;  // stretches of one side, of one cap
};

// Two bars of equal width. Parameters: the point where their middle lines meet (px), directions of the bars
// (rad), half their width (px).
class CrossShape final : public ContourShape {
 public:
  // Lengths from the centre: along the first bar's direction, against it, along the second one's, against it.
  explicit CrossShape(const std::array<double, 4>& arms_px);
  int size() const override { return 5; }
  int translations() const override { return 2; }
  int stretches() const override { return first_[4]; }
  bool plausible(const ShapeParameters& at) const override;
  void place_row(const ShapeParameters& at, double x0, double y, std::span<ContourPlace> row) const override;
  void evaluate(const ShapeParameters& at, double blur_px, ContourBlock& block) const override;
  double movement_px(const ShapeParameters& from, const ShapeParameters& to) const override;

 private:
  double radius_px(const ShapeParameters& at) const override;

  std::array<double, 4> arm_;
  std::array<int, 5> first_;  // index of an arm's first stretch
};

}  // namespace zeropose
