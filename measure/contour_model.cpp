#include "measure/contour_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace zeropose::contour {
namespace {

constexpr std::size_t rows = unknowns + 1;  // the residual is the last one

struct ModelBlock {
  alignas(64) float row[rows][contour_block];
};

// Rows that are not zero, for a shape of some size.
struct UsedRows {
  explicit UsedRows(int shape_size) {
    for (std::size_t k = 0; k < rows; ++k) {
      if (k < std::size_t(shape_size) || k >= std::size_t(blur)) index[count++] = k;
    }
  }
  std::array<std::size_t, rows> index{};
  std::size_t count = 0;
};

// Fills a block; pixels beyond the last one repeat it.
std::size_t gather(const PixelBand& band, std::span<const std::uint32_t> indices, std::size_t from,
                   ContourBlock& block, float* grey) {
  const std::size_t valid = std::min(contour_block, indices.size() - from);
  for (std::size_t i = 0; i < contour_block; ++i) {
    const std::size_t pixel = indices[from + std::min(i, valid - 1)];
    block.x[i] = band.x[pixel];
    block.y[i] = band.y[pixel];
    grey[i] = band.grey[pixel];
  }
  return valid;
}

void differentiate(const ContourBlock& block, const float* grey, int shape_size, const Unknowns& at,
                   ModelBlock& out) {
  const auto low = static_cast<float>(at(mark)), step = static_cast<float>(at(background) - at(mark)),
             light_x = static_cast<float>(at(gx)), light_y = static_cast<float>(at(gy));
  alignas(64) float scale[contour_block];
  for (std::size_t i = 0; i < contour_block; ++i) {
    const float light = 1 + light_x * block.x[i] + light_y * block.y[i];
    const float level = low + step * block.cover[i];
    scale[i] = light * step;
    out.row[blur][i] = scale[i] * block.by_blur[i];
    out.row[background][i] = light * block.cover[i];
    out.row[mark][i] = light * (1 - block.cover[i]);
    out.row[gx][i] = level * block.x[i];
    out.row[gy][i] = level * block.y[i];
    out.row[unknowns][i] = grey[i] - light * level;
  }
  for (int k = 0; k < shape_size; ++k) {
    for (std::size_t i = 0; i < contour_block; ++i) out.row[k][i] = scale[i] * block.by_shape[k][i];
  }
}

// Sums of products of pairs of rows, four partial sums each.
struct PairSums {
  alignas(64) float sum[rows * (rows + 1) / 2][4] = {};
};

void add_products(const ModelBlock& __restrict block, const UsedRows& used, PairSums& __restrict sums) {
  float(*__restrict sum)[4] = sums.sum;
  for (std::size_t i = 0; i < used.count; ++i) {
    const float* __restrict a = block.row[used.index[i]];
    for (std::size_t j = 0; j <= i; ++j, ++sum) {
      const float* __restrict b = block.row[used.index[j]];
      for (std::size_t l = 0; l < 4; ++l) {
        (*sum)[l] += (a[l] * b[l] + a[l + 4] * b[l + 4]) + (a[l + 8] * b[l + 8] + a[l + 12] * b[l + 12]);
      }
    }
  }
}

void unpack(const PairSums& sums, const UsedRows& used, NormalSums& normal) {
  const float(*sum)[4] = sums.sum;
  normal.N.diagonal().setOnes();
  for (std::size_t i = 0; i < used.count; ++i) {
    for (std::size_t j = 0; j <= i; ++j, ++sum) {
      const double total = (double{(*sum)[0]} + double{(*sum)[1]}) + (double{(*sum)[2]} + double{(*sum)[3]});
      const auto a = Eigen::Index(used.index[i]), b = Eigen::Index(used.index[j]);
      if (a < unknowns) {
        normal.N(a, b) = normal.N(b, a) = total;
      } else if (b < unknowns) {
        normal.g(b) = total;
      } else {
        normal.squares = total;
      }
    }
  }
}

// Derivatives of a flat pixel: light by its level, level x and level y by the shading.
void add_flat(const FlatSums& sums, Unknown own, const Unknowns& at, NormalSums& normal) {
  if (!(sums.n > 0)) return;
  const double level = at(own);
  const Eigen::Vector3d light(1, at(gx), at(gy));
  const Eigen::Matrix3d ee{{sums.n, sums.x, sums.y}, {sums.x, sums.xx, sums.xy}, {sums.y, sums.xy, sums.yy}};
  const Eigen::Vector3d rest = Eigen::Vector3d(sums.g, sums.gx, sums.gy) - level * (ee * light);
  Eigen::Matrix3d T = level * Eigen::Matrix3d::Identity();
  T.col(0) = light;
  const Eigen::Matrix3d N = T.transpose() * ee * T;
  const Eigen::Vector3d g = T.transpose() * rest;
  const std::array<Eigen::Index, 3> index{own, gx, gy};
  for (std::size_t i = 0; i < 3; ++i) {
    normal.g(index[i]) += g(Eigen::Index(i));
    for (std::size_t j = 0; j < 3; ++j) normal.N(index[i], index[j]) += N(Eigen::Index(i), Eigen::Index(j));
  }
  normal.squares += flat_misfit(sums, level, at).squares;
  normal.count += sums.n;
}

}  // namespace

void FlatSums::add(double grey, double px, double py) {
  n += 1, x += px, y += py, xx += px * px, xy += px * py, yy += py * py;
  g += grey, gx += grey * px, gy += grey * py, gg += grey * grey;
}

void FlatSums::add(const FlatSums& o) {
  n += o.n, x += o.x, y += o.y, xx += o.xx, xy += o.xy, yy += o.yy;
  g += o.g, gx += o.gx, gy += o.gy, gg += o.gg;
}

FlatMisfit flat_misfit(const FlatSums& s, double level, const Unknowns& at) {
  const double a = level, b = level * at(gx), c = level * at(gy);
  const double sum = s.g - (a * s.n + b * s.x + c * s.y);
  const double squares = s.gg - 2 * (a * s.g + b * s.gx + c * s.gy) + a * a * s.n + b * b * s.xx +
                         c * c * s.yy + 2 * (a * b * s.x + a * c * s.y + b * c * s.xy);
  return {s.n > 0 ? sum / s.n : 0, std::max(0.0, squares)};
}

NormalSums normal_sums(const PixelBand& band, const ActivePixels& active, const ContourShape& shape,
                       const Unknowns& at) {
  const std::span<const std::uint32_t> indices(active.edge);
  const ShapeParameters parameters = at.head<most_shape_parameters>();
  const UsedRows used(shape.size());
  PairSums sums;
  ContourBlock block;
  ModelBlock model;
  alignas(64) float grey[contour_block];
  for (std::size_t from = 0; from < indices.size(); from += contour_block) {
    const std::size_t valid = gather(band, indices, from, block, grey);
    shape.evaluate(parameters, at(blur), block);
    differentiate(block, grey, shape.size(), at, model);
    if (valid < contour_block) {
      for (auto& row : model.row) std::fill(row + valid, row + contour_block, 0.0F);
    }
    add_products(model, used, sums);
  }
  NormalSums normal;
  unpack(sums, used, normal);
  normal.count = double(indices.size());
  add_flat(active.background, background, at, normal);
  add_flat(active.mark, mark, at, normal);
  return normal;
}

void find_residuals(const PixelBand& band, std::span<const std::uint32_t> all, const ContourShape& shape,
                    const Unknowns& at, PixelResiduals& out) {
  const ShapeParameters parameters = at.head<most_shape_parameters>();
  out.residual.resize(band.size());
  out.slope.resize(band.size());
  ContourBlock block;
  ModelBlock model;
  alignas(64) float grey[contour_block];
  for (std::size_t from = 0; from < all.size(); from += contour_block) {
    const std::size_t valid = gather(band, all, from, block, grey);
    shape.evaluate(parameters, at(blur), block);
    differentiate(block, grey, shape.size(), at, model);
    for (std::size_t i = 0; i < valid; ++i) {
      float square = 0;
      for (int k = 0; k < shape.translations(); ++k) square += model.row[k][i] * model.row[k][i];
      out.residual[all[from + i]] = model.row[unknowns][i];
      out.slope[all[from + i]] = std::sqrt(square);
    }
  }
}

}  // namespace zeropose::contour
