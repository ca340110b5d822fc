#include "protocol/conventions.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace zeropose {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// How a maker writes a rotation.
enum class Form { zyx, xyz, zyz, quaternion, rotation_vector, matrix };

struct Maker {
  Convention convention;
  std::string_view name;
  Form form;
  std::array<std::string_view, 4> rotation_fields;
  // Which wire field holds the 1st, 2nd, 3rd factor of the product of elementary rotations.
  std::array<std::size_t, 3> factor_field;
};

constexpr std::array<Maker, 16> makers{{
    {Convention::generic, "generic", Form::zyx, {"rx", "ry", "rz"}, {2, 1, 0}},
    {Convention::kuka, "kuka", Form::zyx, {"A", "B", "C"}, {0, 1, 2}},
    {Convention::fanuc, "fanuc", Form::zyx, {"W", "P", "R"}, {2, 1, 0}},
    {Convention::yaskawa, "yaskawa", Form::zyx, {"Rx", "Ry", "Rz"}, {2, 1, 0}},
    {Convention::mitsubishi, "mitsubishi", Form::zyx, {"A", "B", "C"}, {2, 1, 0}},
    {Convention::epson, "epson", Form::zyx, {"U", "V", "W"}, {0, 1, 2}},
    {Convention::kawasaki, "kawasaki", Form::zyz, {"O", "A", "T"}, {0, 1, 2}},
    {Convention::comau, "comau", Form::zyz, {"A", "E", "R"}, {0, 1, 2}},
    {Convention::staubli, "staubli", Form::xyz, {"Rx", "Ry", "Rz"}, {0, 1, 2}},
    {Convention::abb, "abb", Form::quaternion, {"q1", "q2", "q3", "q4"}, {}},
    {Convention::universal_robots, "universal-robots", Form::rotation_vector, {"rx", "ry", "rz"}, {}},
    {Convention::denso, "denso", Form::zyx, {"Rx", "Ry", "Rz"}, {2, 1, 0}},
    {Convention::techman, "techman", Form::zyx, {"W", "P", "R"}, {2, 1, 0}},
    {Convention::adept, "adept", Form::zyz, {"y", "p", "r"}, {0, 1, 2}},
    {Convention::doosan, "doosan", Form::zyz, {"A", "B", "C"}, {0, 1, 2}},
    {Convention::matrix, "matrix", Form::matrix, {}, {}},
}};

const Maker* find(Convention convention) {
  const auto it = std::ranges::find(makers, convention, &Maker::convention);
  return it == makers.end() ? nullptr : &*it;
}

constexpr std::size_t count_of(Form form) {
  return form == Form::matrix ? 16 : form == Form::quaternion ? 7 : 6;
}

// The first angle is free where only the sum of the outer two is defined: then 0. Each further angle is read
// from what is left of R after taking the former away, so that the product is R at gimbal lock and next to
// it.
double first_angle(double sine_like, double cosine_like) {
  return std::hypot(sine_like, cosine_like) < 1e-12 ? 0 : std::atan2(sine_like, cosine_like);
}

// R = Rz(a) Ry(b) Rx(c), radians.
Vector3d zyx_angles(const Matrix3d& R) {
  const double a = first_angle(R(1, 0), R(0, 0)), s = std::sin(a), c = std::cos(a);
  return {a, std::atan2(-R(2, 0), c * R(0, 0) + s * R(1, 0)),
          std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1))};
}

// R = Rz(a) Ry(b) Rz(c), 0 <= b <= pi.
Vector3d zyz_angles(const Matrix3d& R) {
  const double a = first_angle(R(1, 2), R(0, 2)), s = std::sin(a), c = std::cos(a);
  return {a, std::atan2(c * R(0, 2) + s * R(1, 2), R(2, 2)),
          std::atan2(c * R(1, 0) - s * R(0, 0), c * R(1, 1) - s * R(0, 1))};
}

// R = Rx(a) Ry(b) Rz(c): the transpose is Rz(-c) Ry(-b) Rx(-a).
Vector3d xyz_angles(const Matrix3d& R) {
  const double a = first_angle(-R(1, 2), R(2, 2)), s = std::sin(a), c = std::cos(a);
  return {a, std::atan2(R(0, 2), c * R(2, 2) - s * R(1, 2)),
          std::atan2(c * R(1, 0) + s * R(2, 0), c * R(1, 1) + s * R(2, 1))};
}

Matrix3d product(Form form, const Vector3d& angles_rad) {
  const Vector3d first = form == Form::xyz ? Vector3d::UnitX() : Vector3d::UnitZ();
  const Vector3d last = form == Form::zyx ? Vector3d::UnitX() : Vector3d::UnitZ();
  return (AngleAxisd(angles_rad.x(), first) * AngleAxisd(angles_rad.y(), Vector3d::UnitY()) *
          AngleAxisd(angles_rad.z(), last))
      .toRotationMatrix();
}

std::vector<double> matrix_values(const Pose& X_AB) {
  std::vector<double> values;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) values.push_back(X_AB.matrix()(row, column));
  return values;
}

std::optional<Pose> pose_of(const Matrix3d& R, const Vector3d& p_mm) {
  Pose X_AB = Pose::Identity();
  X_AB.linear() = R;
  X_AB.translation() = p_mm;
  if (!X_AB.matrix().allFinite()) return std::nullopt;
  return X_AB;
}

std::optional<Pose> from_matrix(std::span<const double> values) {
  const Eigen::Matrix4d M = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  const Matrix3d R = M.topLeftCorner<3, 3>();
  const bool is_rotation =
      (R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-4 && R.determinant() > 0;
  const bool is_rigid = (M.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-9;
  if (!is_rotation || !is_rigid) return std::nullopt;
  return pose_of(nearest_rotation(R), M.topRightCorner<3, 1>());
}

std::optional<Pose> from_quaternion(std::span<const double> q, const Vector3d& p_mm) {
  Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (std::abs(rotation.norm() - 1) > 1e-4) return std::nullopt;
  rotation.normalize();
  return pose_of(rotation.toRotationMatrix(), p_mm);
}

}  // namespace

std::string_view name_of(Convention convention) {
  const Maker* maker = find(convention);
  return maker ? maker->name : "unknown";
}

std::optional<Convention> convention_named(std::string_view name) {
  const auto it = std::ranges::find(makers, name, &Maker::name);
  if (it == makers.end()) return std::nullopt;
  return it->convention;
}

std::span<const Convention> all_conventions() {
  static const auto all = [] {
    std::array<Convention, makers.size()> list{};
    std::ranges::transform(makers, list.begin(), &Maker::convention);
    return list;
  }();
  return all;
}

std::vector<std::string_view> field_names(Convention convention) {
  const Maker* maker = find(convention);
  if (!maker) return {};
  if (maker->form == Form::matrix)
    return {"m11", "m12", "m13", "m14", "m21", "m22", "m23", "m24",
            "m31", "m32", "m33", "m34", "m41", "m42", "m43", "m44"};
  const bool small_letters = convention == Convention::generic || convention == Convention::abb ||
                             convention == Convention::universal_robots;
  std::vector<std::string_view> names = small_letters ? std::vector<std::string_view>{"x", "y", "z"}
                                                      : std::vector<std::string_view>{"X", "Y", "Z"};
  for (std::size_t i = 0; i + 3 < count_of(maker->form); ++i) names.push_back(maker->rotation_fields[i]);
  return names;
}

std::vector<double> to_maker(Convention convention, const Pose& X_AB) {
  const Maker* maker = find(convention);
  if (!maker) return {};
  const Matrix3d R = X_AB.linear();
  const Vector3d p = X_AB.translation();
  if (maker->form == Form::matrix) return matrix_values(X_AB);
  if (maker->form == Form::rotation_vector) {
    const Vector3d r = log_so3(R);
    return {p.x() / 1000, p.y() / 1000, p.z() / 1000, r.x(), r.y(), r.z()};
  }
  if (maker->form == Form::quaternion) {
    Eigen::Quaterniond q(R);
    q.normalize();
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    return {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
  }
  const Vector3d factors = maker->form == Form::zyx   ? zyx_angles(R)
                           : maker->form == Form::zyz ? zyz_angles(R)
                                                      : xyz_angles(R);
  std::vector<double> values{p.x(), p.y(), p.z(), 0, 0, 0};
  for (int i = 0; i < 3; ++i)
    values[3 + maker->factor_field[static_cast<std::size_t>(i)]] = factors[i] * degrees_per_radian;
  return values;
}

std::optional<Pose> from_maker(Convention convention, std::span<const double> values) {
  const Maker* maker = find(convention);
  if (!maker || values.size() != count_of(maker->form)) return std::nullopt;
  if (!std::ranges::all_of(values, [](double v) { return std::isfinite(v); })) return std::nullopt;
  if (maker->form == Form::matrix) return from_matrix(values);
  const Vector3d p(values[0], values[1], values[2]);
  const auto rotation = values.subspan(3);
  if (maker->form == Form::quaternion) return from_quaternion(rotation, p);
  if (maker->form == Form::rotation_vector)
    return pose_of(exp_so3({rotation[0], rotation[1], rotation[2]}), 1000 * p);
  Vector3d factors_rad;
  for (int i = 0; i < 3; ++i)
    factors_rad[i] = rotation[maker->factor_field[static_cast<std::size_t>(i)]] / degrees_per_radian;
  return pose_of(product(maker->form, factors_rad), p);
}

}  // namespace zeropose
