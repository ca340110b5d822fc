#include "measure/light_lines.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>

#include "measure/grey_field.h"

namespace zeropose {
namespace {

constexpr double noise_factor = 8;         // of a second derivative, to count as a line
constexpr double step_px = 1.6;            // from one row to the next a chain moves by no more, slope apart
constexpr int chain_gap_px = 6;            // a chain goes on behind so many rows without a centre
constexpr double join_off_px = 3.5;        // of where a piece leads, at the far side of a gap
constexpr std::size_t most_pieces = 150;   // the longest: joining them takes the cube of their count
constexpr double overlap_px = 8;           // where another line crosses, both pieces may go on for a while
constexpr std::ptrdiff_t end_centres = 3;  // at an end: what ends a piece bends it
constexpr std::ptrdiff_t slope_centres = 15;  // before them: they tell where a piece leads

// ---- derivatives of the smoothed image

struct Bells {
  std::vector<float> value, slope, bend;  // a bell curve and its derivatives, from -reach to reach
};

Bells bells_of(double sigma) {
  const int reach = static_cast<int>(std::ceil(3.5 * sigma));
  Bells bells;
  for (int i = -reach; i <= reach; ++i) {
    const double g = std::exp(-i * i / (2 * sigma * sigma)) / (sigma * std::sqrt(2 * std::numbers::pi));
    const double s2 = sigma * sigma;
    bells.value.push_back(static_cast<float>(g));
    bells.slope.push_back(static_cast<float>(i / s2 * g));  // mirrored: turned over by the convolution
    bells.bend.push_back(static_cast<float>((i * i / s2 - 1) / s2 * g));
  }
  const float sum = std::accumulate(bells.bend.begin(), bells.bend.end(), 0.0F);
  for (float& weight : bells.bend) weight -= sum / static_cast<float>(bells.bend.size());  // flat is not bent
  return bells;
}

// Weighted sums along rows; where the weights reach beyond the image the nearest pixel stands in.
GreyField along_rows(const GreyField& field, const std::vector<float>& weights) {
  const int reach = static_cast<int>(weights.size() / 2), width = field.width;
  GreyField result{width, field.height, std::vector<float>(field.grey.size())};
  std::vector<float> padded(static_cast<std::size_t>(width + 2 * reach));
  for (int v = 0; v < field.height; ++v) {
    const float* const row = field.row(v);
    for (int u = -reach; u < width + reach; ++u)
      padded[static_cast<std::size_t>(u + reach)] = row[std::clamp(u, 0, width - 1)];
    float* const to = result.row(v);
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const float weight = weights[i];
      const float* const from = padded.data() + i;
      for (int u = 0; u < width; ++u) to[u] += weight * from[u];
    }
  }
  return result;
}

GreyField along_columns(const GreyField& field, const std::vector<float>& weights) {
  const int reach = static_cast<int>(weights.size() / 2);
  GreyField result{field.width, field.height, std::vector<float>(field.grey.size())};
  for (int v = 0; v < field.height; ++v) {
    float* const to = result.row(v);
    for (int i = -reach; i <= reach; ++i) {
      const float weight = weights[static_cast<std::size_t>(i + reach)];
      const float* const from = field.row(std::clamp(v + i, 0, field.height - 1));
      for (int u = 0; u < field.width; ++u) to[u] += weight * from[u];
    }
  }
  return result;
}

struct Derivatives {
  GreyField u, v, uu, uv, vv;
};

Derivatives derivatives_of(const GreyField& field, double sigma) {
  const Bells bells = bells_of(sigma);
  const GreyField value = along_rows(field, bells.value), slope = along_rows(field, bells.slope);
  return {along_columns(slope, bells.value), along_columns(value, bells.slope),
          along_columns(along_rows(field, bells.bend), bells.value), along_columns(slope, bells.slope),
          along_columns(value, bells.bend)};
}

GreyField transposed(const GreyField& field) {
  GreyField result{field.height, field.width, std::vector<float>(field.grey.size())};
  for (int v = 0; v < field.height; ++v)
    for (int u = 0; u < field.width; ++u) result.row(u)[v] = field.row(v)[u];
  return result;
}

// Rows for columns, so that level lines are found as upright ones.
Derivatives transposed(const Derivatives& d) {
  return {transposed(d.v), transposed(d.u), transposed(d.vv), transposed(d.uv), transposed(d.uu)};
}

// ---- centres

struct Limits {
  double least_bend = 0;   // of the second derivative across
  double slope_noise = 0;  // sigma of the first derivative
};

// A line's section of contrast A and the same sigma as the smoothing has the second derivative
// -A / (2^1.5 sigma^2) in its middle; white noise n gives that one the sigma n sqrt(3 / (16 pi)) / sigma^3
// and the first one n / (sqrt(8 pi) sigma^2).
Limits limits_of(double noise_grey, const LightLineSearch& search) {
  const double s = search.sigma_px, pi = std::numbers::pi;
  const double bend_noise = noise_grey * std::sqrt(3 / (16 * pi)) / (s * s * s);
  return {std::max(search.min_contrast / (std::pow(2, 1.5) * s * s), noise_factor * bend_noise),
          noise_grey / (std::sqrt(8 * pi) * s * s)};
}

struct Candidate {
  LineCentre centre;
  double bend = 0;  // against the second derivative: the larger, the clearer
};

std::optional<Candidate> centre_at(const Derivatives& d, int u, int v, const Limits& limits) {
  const double uu = d.uu.row(v)[u], uv = d.uv.row(v)[u], vv = d.vv.row(v)[u];
  if (uu > -limits.least_bend / 2)
    return std::nullopt;  // an upright line bends across columns by half at least
  const double half_sum = (uu + vv) / 2, root = std::hypot((uu - vv) / 2, uv);
  const double bend = half_sum - root;  // the most negative one
  if (bend > -limits.least_bend) return std::nullopt;
  Eigen::Vector2d n(uv, bend - uu);
  if (std::abs(bend - vv) > std::abs(bend - uu)) n = {bend - vv, uv};
  n.normalize();
  if (std::abs(n.x()) <= std::abs(n.y())) return std::nullopt;
  const double off = -(d.u.row(v)[u] * n.x() + d.v.row(v)[u] * n.y()) / bend;
  const double du = off / n.x();  // where the line crosses this row
  if (std::abs(du) > 0.6) return std::nullopt;
  return Candidate{{double(v), u + du, limits.slope_noise / (-bend * std::abs(n.x()))}, -bend};
}

std::vector<Candidate> centres_of_row(const Derivatives& d, int v, const Limits& limits) {
  std::vector<Candidate> row;
  for (int u = 0; u < d.u.width; ++u) {
    const auto candidate = centre_at(d, u, v, limits);
    if (!candidate) continue;
    if (row.empty() || candidate->centre.place - row.back().centre.place > 1.5)
      row.push_back(*candidate);
    else if (candidate->bend > row.back().bend)
      row.back() = *candidate;
  }
  return row;
}

// ---- chains

// A straight line through the centres of one end but for the last `without`, by least squares.
double leads_to(const std::vector<LineCentre>& centres, bool forwards, double at,
                std::ptrdiff_t without = 0) {
  const std::ptrdiff_t left = std::max<std::ptrdiff_t>(1, std::ssize(centres) - without);
  const std::ptrdiff_t count = std::min(slope_centres, left);
  const auto begin = forwards ? centres.begin() + (left - count) : centres.end() - left;
  double mean_at = 0, mean_place = 0, squares = 0, products = 0;
  for (auto c = begin; c != begin + count; ++c) mean_at += c->at, mean_place += c->place;
  mean_at /= static_cast<double>(count), mean_place /= static_cast<double>(count);
  for (auto c = begin; c != begin + count; ++c) {
    squares += (c->at - mean_at) * (c->at - mean_at);
    products += (c->at - mean_at) * (c->place - mean_place);
  }
  const double slope = count < 4 ? 0 : products / squares;
  return mean_place + slope * (at - mean_at);
}

using Chain = std::vector<LineCentre>;

// The open chain that comes nearest to the centre.
Chain* chain_for(std::vector<Chain>& open, const LineCentre& centre) {
  Chain* best = nullptr;
  double least = step_px;
  for (Chain& chain : open) {
    if (chain.back().at >= centre.at) continue;  // has one in this row
    const double off = std::min(std::abs(leads_to(chain, true, centre.at) - centre.place),
                                std::abs(chain.back().place - centre.place));
    if (off < least) least = off, best = &chain;
  }
  return best;
}

std::vector<Chain> chains_of(const Derivatives& d, const Limits& limits, double min_length_px) {
  std::vector<Chain> open, done;
  const auto close_before = [&](double at) {
    for (Chain& chain : open)
      if (chain.back().at < at && chain.back().at - chain.front().at >= min_length_px)
        done.push_back(std::move(chain));
    std::erase_if(open, [&](const Chain& chain) { return chain.empty() || chain.back().at < at; });
  };
  for (int v = 0; v < d.u.height; ++v) {
    for (const Candidate& candidate : centres_of_row(d, v, limits)) {
      if (Chain* const chain = chain_for(open, candidate.centre))
        chain->push_back(candidate.centre);
      else
        open.push_back({candidate.centre});
    }
    close_before(v - chain_gap_px);
  }
  close_before(d.u.height + 1);
  return done;
}

// By how much b does not go on where a leads, seen from both; nothing where it cannot.
std::optional<double> misfit(const Chain& a, const Chain& b, double max_join_px) {
  const double gap = b.front().at - a.back().at;
  if (gap < -overlap_px || gap > max_join_px || a.front().at >= b.front().at || a.back().at >= b.back().at)
    return std::nullopt;
  const double middle = (a.back().at + b.front().at) / 2;
  const double off =
      std::abs(leads_to(a, true, middle, end_centres) - leads_to(b, false, middle, end_centres));
  if (off > join_off_px) return std::nullopt;
  return off + 0.1 * std::abs(gap);
}

void join(std::vector<Chain>& chains, double max_join_px) {
  for (;;) {
    std::optional<double> least;
    std::size_t from = 0, to = 0;
    for (std::size_t a = 0; a < chains.size(); ++a) {
      for (std::size_t b = 0; b < chains.size(); ++b) {
        const auto off = a == b ? std::nullopt : misfit(chains[a], chains[b], max_join_px);
        if (off && (!least || *off < *least)) least = off, from = a, to = b;
      }
    }
    if (!least) return;
    Chain &a = chains[from], &b = chains[to];
    const double begin = b.front().at;
    std::erase_if(a, [&](const LineCentre& centre) { return centre.at >= begin; });
    a.insert(a.end(), b.begin(), b.end());
    chains.erase(chains.begin() + static_cast<std::ptrdiff_t>(to));
  }
}

std::vector<LightLine> lines_of(const Derivatives& d, LineCourse course, const Limits& limits,
                                const LightLineSearch& search) {
  std::vector<Chain> chains = chains_of(d, limits, search.min_length_px);
  if (chains.size() > most_pieces) {
    const auto length = [](const Chain& chain) { return chain.back().at - chain.front().at; };
    std::ranges::sort(chains, std::ranges::greater{}, length);
    chains.resize(most_pieces);
  }
  join(chains, search.max_join_px);
  std::vector<LightLine> lines;
  for (Chain& chain : chains) lines.push_back({course, std::move(chain)});
  return lines;
}

}  // namespace

std::optional<double> LightLine::place_at(double at) const {
  if (centres.size() < 2 || !(at >= from() && at <= to())) return std::nullopt;
  auto after = std::ranges::upper_bound(centres, at, {}, &LineCentre::at);
  if (after == centres.end()) --after;
  const LineCentre &a = *(after - 1), &b = *after;
  return a.place + (at - a.at) / (b.at - a.at) * (b.place - a.place);
}

double LightLine::unseen_px(double at) const {
  const auto after = std::ranges::lower_bound(centres, at, {}, &LineCentre::at);
  double least = after == centres.end() ? at - to() : after->at - at;
  if (after != centres.begin()) least = std::min(least, at - (after - 1)->at);
  return least;
}

// The errors of two centres k rows apart have the correlation exp(-k^2 / (4 sigma^2)).
double neighbours_gain(const LightLineSearch& search) {
  return 2 * std::sqrt(std::numbers::pi) * search.sigma_px;
}

LightLines find_light_lines(const ImageView& image, const LightLineSearch& search) {
  assert(image.width_px > 16 && image.height_px > 16);
  const PixelWindow all{0, 0, image.width_px - 1, image.height_px - 1};
  const Limits limits = limits_of(noise_grey(image, all), search);
  const Derivatives derivatives = derivatives_of(field_of(image, all), search.sigma_px);
  return {lines_of(derivatives, LineCourse::upright, limits, search),
          lines_of(transposed(derivatives), LineCourse::level, limits, search)};
}

}  // namespace zeropose
