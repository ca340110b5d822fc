#include "measure/ellipse_model.h"

#include <algorithm>
#include <cmath>

#include "measure/normal_bell.h"

namespace zeropose::ellipse_model {
namespace {

constexpr std::size_t block_size = 16, columns = unknowns + 1;

// Ten derivatives and the residual (last) of some pixels, one row each.
struct Block {
  alignas(64) float row[columns][block_size];
};

// What differentiate() needs of the state, in single precision.
struct Constants {
  explicit Constants(const State& state)
      : u(float(state.at(cu))),
        v(float(state.at(cv))),
        r2(float(1 / state.R2)),
        a(float(state.at(p11)) * r2),
        b(float(state.at(p12)) * r2),
        c(float(state.at(p22)) * r2),
        low(float(state.at(mark))),
        step(float(state.at(background) - state.at(mark))),
        inverse_blur(float(1 / state.at(blur))),
        light_x(float(state.at(gx))),
        light_y(float(state.at(gy))),
        blur_c(float(state.blur_c)),
        blur_s(float(state.blur_s)) {}
  float u, v, r2, a, b, c, low, step, inverse_blur, light_x, light_y, blur_c, blur_s;
};

[[gnu::always_inline]] inline void differentiate(const float* __restrict grey, const float* __restrict px,
                                                 const float* __restrict py, const Constants k,
                                                 Block& __restrict out) {
  for (std::size_t i = 0; i < block_size; ++i) {
    const float x = px[i] - k.u, y = py[i] - k.v;
    const float wx = k.a * x + k.b * y, wy = k.b * x + k.c * y;
    const float q = std::max(x * wx + y * wy, 1e-6F), rho = std::sqrt(q);
    const float im = 1 / std::sqrt(wx * wx + wy * wy + 1e-12F);
    const float d = (q - rho) * im;
    const float along = 2 * im * im;
    const float sharpness =
        k.inverse_blur * (1 + k.blur_c * (along * wx * wx - 1) + k.blur_s * along * wx * wy);
    const NormalBell edge = normal_bell(d * sharpness);
    const float light = 1 + k.light_x * px[i] + k.light_y * py[i];
    const float level = k.low + k.step * edge.below;
    const float slope = light * k.step * edge.density * sharpness;
    const float by_q = slope * im * (1 - 0.5F / rho), by_m = slope * d * im * im;
    out.row[cu][i] = by_m * (k.a * wx + k.b * wy) - 2 * by_q * wx;
    out.row[cv][i] = by_m * (k.b * wx + k.c * wy) - 2 * by_q * wy;
    out.row[p11][i] = (by_q * x - by_m * wx) * x * k.r2;
    out.row[p12][i] = (2 * by_q * x * y - by_m * (wx * y + wy * x)) * k.r2;
    out.row[p22][i] = (by_q * y - by_m * wy) * y * k.r2;
    out.row[blur][i] = -slope * d * k.inverse_blur;
    out.row[background][i] = light * edge.below;
    out.row[mark][i] = light * (1 - edge.below);
    out.row[gx][i] = level * px[i];
    out.row[gy][i] = level * py[i];
    out.row[unknowns][i] = grey[i] - light * level;
  }
}

// Sums of products of pairs of rows, some partial sums each: the residual's pairs first.
struct Products {
  static constexpr std::size_t lanes = 8;
  alignas(64) float sum[columns * (columns + 1) / 2][lanes] = {};
};

[[gnu::always_inline]] inline void add_products(const Block& __restrict block, Wanted wanted,
                                                Products& __restrict products) {
  float(*__restrict sum)[Products::lanes] = products.sum;
  const std::size_t last = wanted == Wanted::gradient ? unknowns : 0;
  for (std::size_t i = columns; i-- > last;) {
    const float* __restrict a = block.row[i];
    for (std::size_t j = 0; j <= i; ++j, ++sum) {
      const float* __restrict b = block.row[j];
      for (std::size_t l = 0; l < Products::lanes; ++l)
        (*sum)[l] += a[l] * b[l] + a[l + Products::lanes] * b[l + Products::lanes];
    }
  }
}

// Takes over what was wanted, leaves the rest.
void unpack(const Products& products, Wanted wanted, Normal& normal) {
  const auto total = [&products](Eigen::Index pair) {
    const float* sum = products.sum[pair];
    return ((double{sum[0]} + double{sum[1]}) + (double{sum[2]} + double{sum[3]})) +
           ((double{sum[4]} + double{sum[5]}) + (double{sum[6]} + double{sum[7]}));
  };
  Eigen::Index pair = 0;
  for (; pair < unknowns; ++pair) normal.g(pair) = total(pair);
  normal.squares = total(pair++);
  if (wanted == Wanted::gradient) return;
  for (Eigen::Index i = unknowns; i-- > 0;) {
    for (Eigen::Index j = 0; j <= i; ++j, ++pair) normal.N(i, j) = normal.N(j, i) = total(pair);
  }
}

// Sums by sector. Neighbouring pixels lie in the same one, and a sum that is added to at every pixel waits
// for itself each time: so four take turns.
struct SectorSums {
  static constexpr std::size_t turns = 4;
  float rs[turns][Sectors::count] = {}, ss[turns][Sectors::count] = {};

  Sectors total() const {
    Sectors sum;
    for (std::size_t k = 0; k < Sectors::count; ++k) {
      sum.rs[k] = (rs[0][k] + rs[1][k]) + (rs[2][k] + rs[3][k]);
      sum.ss[k] = (ss[0][k] + ss[1][k]) + (ss[2][k] + ss[3][k]);
    }
    return sum;
  }
};

// Pixels beyond the valid ones have slope 0.
[[gnu::always_inline]] inline void add_sectors(const Block& __restrict block, const float* __restrict px,
                                               const float* __restrict py, const Constants& k,
                                               SectorSums& __restrict sums) {
  int sector[block_size];
  float rs[block_size], ss[block_size];
  for (std::size_t i = 0; i < block_size; ++i) {
    const float x = px[i] - k.u, y = py[i] - k.v, ax = std::abs(x), ay = std::abs(y);
    const int octant = (x < 0 ? 1 : 0) + (y < 0 ? 2 : 0) + (ax < ay ? 4 : 0);
    const bool upper = std::min(ax, ay) > 0.4142F * std::max(ax, ay);  // tan 22.5 deg
    sector[i] = 2 * octant + (upper ? 1 : 0);
    const float du = block.row[cu][i], dv = block.row[cv][i];
    ss[i] = du * du + dv * dv;
    rs[i] = block.row[unknowns][i] * std::sqrt(ss[i]);
  }
  for (std::size_t i = 0; i < block_size; ++i) {
    sums.rs[i % SectorSums::turns][sector[i]] += rs[i];
    sums.ss[i % SectorSums::turns][sector[i]] += ss[i];
  }
}

[[gnu::always_inline]] inline void evaluate(const EllipseBand& band, const State& state, Wanted wanted,
                                            Normal& normal, Sectors& sectors, std::size_t stride) {
  const Constants constants(state);
  Products products;
  Block block;
  SectorSums by_sector;
  const std::size_t n = band.size();
  for (std::size_t i = 0; i < n; i += stride * block_size) {
    differentiate(&band.grey[i], &band.x[i], &band.y[i], constants, block);
    const std::size_t valid = std::min(block_size, n - i);
    if (valid < block_size) {
      for (auto& row : block.row) std::fill(row + valid, row + block_size, 0.0F);
    }
    add_products(block, wanted, products);
    if (wanted == Wanted::gradient) add_sectors(block, &band.x[i], &band.y[i], constants, by_sector);
  }
  unpack(products, wanted, normal);
  sectors = by_sector.total();
  normal.count = double(n);
}

#ifdef __x86_64__
[[gnu::target("avx2,fma")]] void evaluate_wide(const EllipseBand& band, const State& state, Wanted wanted,
                                               Normal& normal, Sectors& sectors, std::size_t stride) {
  evaluate(band, state, wanted, normal, sectors, stride);
}
const bool has_wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#endif

}  // namespace

void evaluate_edge(const EllipseBand& band, const State& state, Wanted wanted, Normal& normal,
                   Sectors& sectors, std::size_t stride) {
#ifdef __x86_64__
  if (has_wide) return evaluate_wide(band, state, wanted, normal, sectors, stride);
#endif
  evaluate(band, state, wanted, normal, sectors, stride);
}

}  // namespace zeropose::ellipse_model
