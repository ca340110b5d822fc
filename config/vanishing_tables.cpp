#include "config/vanishing_tables.h"

#include <algorithm>
#include <array>

#include "config/csv.h"
#include "config/text.h"

namespace zeropose {
namespace {

// Vanishing points may lie very far away; corners lie near the image.
constexpr double farthest_px = 1e12, farthest_corner_px = 1e6;

}  // namespace

std::vector<VanishingPair> load_vanishing_pairs(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, {{"v1_u_px", "v1_v_px", "v2_u_px", "v2_v_px"}, {}});
  const auto pixel = [&](std::size_t row, std::string_view column) {
    return table.number(row, column, -farthest_px, farthest_px);
  };
  std::vector<VanishingPair> pairs;
  for (std::size_t row = 0; row < table.rows(); ++row)
    pairs.push_back(
        {{pixel(row, "v1_u_px"), pixel(row, "v1_v_px")}, {pixel(row, "v2_u_px"), pixel(row, "v2_v_px")}});
  table.throw_if_wrong();
  return pairs;
}

std::vector<RectangleImage> load_rectangle_images(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, {{"image", "corner", "u_px", "v_px"}, {}});
  std::vector<RectangleImage> images;
  std::vector<std::array<bool, 4>> seen;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string name = table.text(row, "image");
    const double corner = table.number(row, "corner", 1, 4);
    const Eigen::Vector2d u_px(table.number(row, "u_px", -farthest_corner_px, farthest_corner_px),
                               table.number(row, "v_px", -farthest_corner_px, farthest_corner_px));
    const auto found = std::ranges::find(images, name, &RectangleImage::name);
    const auto index = static_cast<std::size_t>(found - images.begin());
    if (found == images.end()) {
      images.push_back({name, {}});
      seen.push_back({});
    }
    if (corner < 1) continue;  // a mistake already
    const auto place = static_cast<std::size_t>(corner) - 1;
    if (corner != static_cast<double>(place + 1))
      table.add_mistake(row, "corner", std::to_string(corner), "1, 2, 3 or 4");
    else if (seen[index][place])
      table.add_mistake(row, "corner", concat({std::to_string(place + 1), " again in this image"}),
                        "each corner once");
    seen[index][place] = true;
    images[index].corners_px[place] = u_px;
  }
  table.throw_if_wrong();
  std::vector<std::string> mistakes;
  for (std::size_t i = 0; i < images.size(); ++i)
    if (const auto corners = std::count(seen[i].begin(), seen[i].end(), true); corners != 4)
      mistakes.push_back(concat({path.string(), ": image ", in_quotes(images[i].name), ": found ",
                                 std::to_string(corners), " corners, expected the four from 1 to 4"}));
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
  return images;
}

}  // namespace zeropose
