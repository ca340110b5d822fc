#include "measure/edge_map.h"

#include <algorithm>
#include <cmath>

namespace zeropose {
namespace {

// Gradient by Scharr's filter, grey levels per pixel.
struct Slopes {
  int width, height;
  std::vector<float> x, y;

  explicit Slopes(const SearchImage& image) : width(image.width()), height(image.height()) {
    const auto size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    x.assign(size, 0);
    y.assign(size, 0);
    for (int v = 1; v + 1 < height; ++v) {
      const std::uint8_t *a = image.row(v - 1), *b = image.row(v), *c = image.row(v + 1);
      float* __restrict sx = &x[std::size_t(v * width)];
      float* __restrict sy = &y[std::size_t(v * width)];
      for (int u = 1; u + 1 < width; ++u) {
        const int right = 3 * (a[u + 1] + c[u + 1]) + 10 * b[u + 1];
        const int left = 3 * (a[u - 1] + c[u - 1]) + 10 * b[u - 1];
        const int down = 3 * (c[u - 1] + c[u + 1]) + 10 * c[u];
        const int up = 3 * (a[u - 1] + a[u + 1]) + 10 * a[u];
        sx[u] = static_cast<float>(right - left) / 32;
        sy[u] = static_cast<float>(down - up) / 32;
      }
    }
  }
  float size(int u, int v) const {
    const auto i = std::size_t(v * width + u);
    return std::hypot(x[i], y[i]);
  }
};

// The steepness between pixels, along the rise; half a pixel's accuracy is enough to compare.
float size_beside(const Slopes& slopes, int u, int v, float du, float dv) {
  const float across = std::max(std::abs(du), std::abs(dv));
  const float su = du / across, sv = dv / across;  // one of them is +-1
  const int iu = static_cast<int>(std::floor(float(u) + su)),
            iv = static_cast<int>(std::floor(float(v) + sv));
  const float fu = float(u) + su - float(iu), fv = float(v) + sv - float(iv);
  if (fu > 0) return (1 - fu) * slopes.size(iu, iv) + fu * slopes.size(iu + 1, iv);
  return fv > 0 ? (1 - fv) * slopes.size(iu, iv) + fv * slopes.size(iu, iv + 1) : slopes.size(iu, iv);
}

}  // namespace

EdgeMap edge_map(const SearchImage& image, float least_steepness) {
  EdgeMap map{image.width(), image.height(), {}, {}};
  map.index.assign(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height), -1);
  const Slopes slopes(image);
  for (int v = 2; v + 2 < map.height; ++v) {
    for (int u = 2; u + 2 < map.width; ++u) {
      const auto i = std::size_t(v * map.width + u);
      const float gx = slopes.x[i], gy = slopes.y[i];
      const float square = gx * gx + gy * gy;
      if (!(square > 0) || square < least_steepness * least_steepness) continue;
      const float here = slopes.size(u, v);
      const float before = size_beside(slopes, u, v, -gx, -gy), after = size_beside(slopes, u, v, gx, gy);
      if (!(here >= before && here > after)) continue;
      const float bend = before - 2 * here + after;
      const float step = bend < 0 ? std::clamp(0.5F * (before - after) / bend, -0.7F, 0.7F) : 0;
      const Eigen::Vector2f rise = Eigen::Vector2f(gx, gy) / here;
      const float across = std::max(std::abs(rise.x()), std::abs(rise.y()));
      map.index[i] = static_cast<int>(map.points.size());
      map.points.push_back({Eigen::Vector2f(float(u), float(v)) + step / across * rise, rise, here});
    }
  }
  return map;
}

}  // namespace zeropose
