#include "measure/pattern_level.h"

#include <algorithm>

namespace zeropose {
namespace {

constexpr int lanes = PatternLevel::lanes;
using Lanes = Eigen::Array<float, lanes, 1>;

Lanes lanes_at(const std::vector<float>& values, std::size_t i) {
  return Eigen::Map<const Lanes>(values.data() + i);
}

enum Moment { uu, uv, vv, ut, vt, u1, v1, tt, t1, one, moments };

// Sums along one row of products of slopes and greys, times 1, x and x^2.
struct RowSums {
  double plain[moments], by_x[moments], by_xx[3];
};

RowSums sums_of_row(const PatternLevel& p, const std::vector<float>& weights, std::size_t begin) {
  Lanes plain[moments], by_x[moments], by_xx[3];
  for (Lanes& sum : plain) sum.setZero();
  for (Lanes& sum : by_x) sum.setZero();
  for (Lanes& sum : by_xx) sum.setZero();
  for (std::size_t i = 0; i < std::size_t(p.stride); i += lanes) {
    const Lanes w = lanes_at(weights, begin + i), x = lanes_at(p.across, i), t = lanes_at(p.grey, begin + i);
    const Lanes u = lanes_at(p.slope_u, begin + i), v = lanes_at(p.slope_v, begin + i);
    const Lanes wu = w * u, wv = w * v, wt = w * t;
    const Lanes products[moments] = {wu * u, wu * v, wv * v, wu * t, wv * t, wu, wv, wt * t, wt, w};
    for (int k = 0; k < moments; ++k) plain[k] += products[k];
    for (int k = 0; k < tt; ++k) by_x[k] += x * products[k];
    for (int k = 0; k < 3; ++k) by_xx[k] += x * x * products[k];
  }
  RowSums sums{};
  for (int k = 0; k < moments; ++k) sums.plain[k] = double(plain[k].sum());
  for (int k = 0; k < tt; ++k) sums.by_x[k] = double(by_x[k].sum());
  for (int k = 0; k < 3; ++k) sums.by_xx[k] = double(by_xx[k].sum());
  return sums;
}

// Place of a slope's derivatives among the unknowns: by 1, x, y.
constexpr int place[2][3] = {{0, 2, 3}, {1, 4, 5}};

// One pair of slopes (a, b): outer product of (1, x, y) with itself.
void add_pair(int a, int b, double s, double sx, double sxx, double y, MatchMatrix& N) {
  const double outer[3][3] = {{s, sx, s * y}, {sx, sxx, sx * y}, {s * y, sx * y, s * y * y}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) N(place[a][i], place[b][j]) += outer[i][j];
  }
}

void add_row(const RowSums& s, double y, MatchMatrix& N) {
  add_pair(0, 0, s.plain[uu], s.by_x[uu], s.by_xx[uu], y, N);
  add_pair(1, 0, s.plain[uv], s.by_x[uv], s.by_xx[uv], y, N);
  add_pair(1, 1, s.plain[vv], s.by_x[vv], s.by_xx[vv], y, N);
  for (int a = 0; a < 2; ++a) {
    const int with_grey = a == 0 ? ut : vt, alone = a == 0 ? u1 : v1;
    N(6, place[a][0]) += s.plain[with_grey];
    N(6, place[a][1]) += s.by_x[with_grey];
    N(6, place[a][2]) += s.plain[with_grey] * y;
    N(7, place[a][0]) += s.plain[alone];
    N(7, place[a][1]) += s.by_x[alone];
    N(7, place[a][2]) += s.plain[alone] * y;
  }
  N(6, 6) += s.plain[tt];
  N(7, 6) += s.plain[t1];
  N(7, 7) += s.plain[one];
}

// The part that was summed up: slopes along v by slopes along u, and the rows of gain and offset.
void mirror(MatchMatrix& N) {
  for (const int i : place[1]) {
    for (const int j : place[0]) N(j, i) = N(i, j);
  }
  for (int i = 6; i < match_unknowns; ++i) {
    for (int j = 0; j < i; ++j) N(j, i) = N(i, j);
  }
}

}  // namespace

PatternLevel::PatternLevel(const GreyField& patch)
    : width(patch.width - 2),
      height(patch.height - 2),
      stride((width + lanes - 1) / lanes * lanes),
      middle_px(0.5 * (patch.width - 1), 0.5 * (patch.height - 1)) {
  const GreySlopes slopes = slopes_of(patch);
  const std::size_t count = std::size_t(stride) * std::size_t(height);
  for (std::vector<float>* part : {&grey, &slope_u, &slope_v, &counts}) part->assign(count, 0.0F);
  double sum = 0, squares = 0;
  for (int j = 0; j < height; ++j) {
    const std::ptrdiff_t begin = std::ptrdiff_t{j} * stride;
    std::copy_n(patch.row(j + 1) + 1, width, grey.begin() + begin);
    std::copy_n(slopes.along_u.row(j + 1) + 1, width, slope_u.begin() + begin);
    std::copy_n(slopes.along_v.row(j + 1) + 1, width, slope_v.begin() + begin);
    std::fill_n(counts.begin() + begin, width, 1.0F);
    for (int i = 0; i < width; ++i) {
      const double g = double{grey[static_cast<std::size_t>(begin + i)]};
      sum += g;
      squares += g * g;
    }
  }
  mean_grey = sum / area();
  variance_grey2 = std::max(0.0, squares / area() - mean_grey * mean_grey);
  for (int j = 0; j < height; ++j) {  // about their mean: gain and offset hardly disturb each other
    for (int i = 0; i < width; ++i) {
      grey[std::size_t(j) * std::size_t(stride) + std::size_t(i)] -= static_cast<float>(mean_grey);
    }
  }
  across.assign(std::size_t(stride), 0.0F);
  for (int i = 0; i < width; ++i) across[std::size_t(i)] = static_cast<float>(i - 0.5 * (width - 1));
}

MatchMatrix information_of(const PatternLevel& level, const std::vector<float>& weights) {
  MatchMatrix N = MatchMatrix::Zero();
  for (int j = 0; j < level.height; ++j) {
    add_row(sums_of_row(level, weights, std::size_t(j) * std::size_t(level.stride)), level.down(j), N);
  }
  mirror(N);
  return N;
}

MatchMatrix slope_noise_of(const PatternLevel& level) {
  MatchMatrix E = MatchMatrix::Zero();
  const double n = level.area() * slope_noise_gain;
  for (const auto& [shift, by_x, by_y] : place) {
    E(shift, shift) = n;
    E(by_x, by_x) = n * (double(level.width) * level.width - 1) / 12;
    E(by_y, by_y) = n * (double(level.height) * level.height - 1) / 12;
  }
  return E;
}

MatchVector gradient_of(const PatternLevel& p, const std::vector<float>& weighted_residuals) {
  MatchVector b = MatchVector::Zero();
  for (int j = 0; j < p.height; ++j) {
    Lanes sums[6];
    for (Lanes& sum : sums) sum.setZero();
    const std::size_t begin = std::size_t(j) * std::size_t(p.stride);
    for (std::size_t i = 0; i < std::size_t(p.stride); i += lanes) {
      const Lanes r = lanes_at(weighted_residuals, begin + i), x = lanes_at(p.across, i);
      const Lanes u = r * lanes_at(p.slope_u, begin + i), v = r * lanes_at(p.slope_v, begin + i);
      sums[0] += u, sums[1] += u * x, sums[2] += v, sums[3] += v * x;
      sums[4] += r * lanes_at(p.grey, begin + i), sums[5] += r;
    }
    const double y = p.down(j);
    for (int a = 0; a < 2; ++a) {
      const double s = double(sums[2 * a].sum());
      b(place[a][0]) += s;
      b(place[a][1]) += double(sums[2 * a + 1].sum());
      b(place[a][2]) += s * y;
    }
    b(6) += double(sums[4].sum());
    b(7) += double(sums[5].sum());
  }
  return b;
}

Eigen::Matrix<double, 2, match_unknowns> motion_of(const Eigen::Vector2d& point_px) {
  Eigen::Matrix<double, 2, match_unknowns> M = Eigen::Matrix<double, 2, match_unknowns>::Zero();
  for (int a = 0; a < 2; ++a) {
    M(a, place[a][0]) = 1;
    M(a, place[a][1]) = point_px.x();
    M(a, place[a][2]) = point_px.y();
  }
  return M;
}

}  // namespace zeropose
