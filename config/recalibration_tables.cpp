#include "config/recalibration_tables.h"

#include <map>
#include <optional>
#include <string>

#include "config/csv.h"
#include "config/table_columns.h"
#include "config/text.h"

namespace zeropose {
namespace {

// Group and name; without groups the first is empty.
using Key = std::pair<std::string, std::string>;

struct Seen {
  std::size_t row = 0;
  Eigen::Vector2d u_px;
  Eigen::Matrix2d covariance_px2;
};

std::string words_of(const Key& key) {
  return key.first.empty() ? in_quotes(key.second)
                           : concat({in_quotes(key.second), " of group ", in_quotes(key.first)});
}

Key key_of(CsvTable& table, std::size_t row) {
  return {table.has("group") ? table.text(row, "group") : std::string(), table.text(row, "point")};
}

// One of the two tables of pixels.
struct Pixels {
  CsvTable table;
  std::vector<Key> order;
  std::map<Key, Seen> seen;
};

Pixels load_pixels(const std::filesystem::path& path, bool grouped) {
  CsvColumns columns{{"point", "u_px", "v_px"}, {"suu", "svv", "suv"}};
  (grouped ? columns.required : columns.optional).push_back("group");
  Pixels pixels{load_csv(path, columns), {}, {}};
  for (std::size_t row = 0; row < pixels.table.rows(); ++row) {
    const Key key = key_of(pixels.table, row);
    const Seen seen{row, pixel_of(pixels.table, row), covariance_of(pixels.table, row)};
    if (key.second.empty()) continue;
    if (!pixels.seen.emplace(key, seen).second)
      pixels.table.add_mistake(row, "point", words_of(key) + " again", "each point once");
    else
      pixels.order.push_back(key);
  }
  return pixels;
}

void require_partners(Pixels& pixels, const Pixels& others, const std::filesystem::path& other_file) {
  for (const Key& key : pixels.order)
    if (!others.seen.contains(key))
      pixels.table.add_mistake(pixels.seen.at(key).row, "point", words_of(key) + " without a partner",
                               concat({"a point that ", other_file.string(), " has as well"}));
}

std::map<Key, Eigen::Vector3d> load_places(const std::filesystem::path& path) {
  CsvTable table = load_csv(path, {{"point", "x_mm", "y_mm", "z_mm"}, {"group"}});
  std::map<Key, Eigen::Vector3d> places;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Key key = key_of(table, row);
    const Eigen::Vector3d p_mm(table.number(row, "x_mm", -largest_mm, largest_mm),
                               table.number(row, "y_mm", -largest_mm, largest_mm),
                               table.number(row, "z_mm", -largest_mm, largest_mm));
    if (!key.second.empty() && !places.emplace(key, p_mm).second)
      table.add_mistake(row, "point", words_of(key) + " again", "each point once");
  }
  table.throw_if_wrong();
  return places;
}

std::optional<Eigen::Vector3d> place_of(const std::map<Key, Eigen::Vector3d>& places, const Key& key) {
  auto found = places.find(key);
  if (found == places.end()) found = places.find({std::string(), key.second});
  if (found == places.end()) return std::nullopt;
  return found->second;
}

// Runs the readings and throws the mistakes of all of them.
template <typename... Reading>
void all_mistakes_of(const Reading&... readings) {
  std::vector<std::string> mistakes;
  const auto collect = [&mistakes](const auto& reading) {
    try {
      reading();
    } catch (const ConfigError& error) {
      mistakes.insert(mistakes.end(), error.mistakes().begin(), error.mistakes().end());
    }
  };
  (collect(readings), ...);
  if (!mistakes.empty()) throw ConfigError(std::move(mistakes));
}

}  // namespace

std::vector<RecalibrationPoint> load_recalibration_points(RecalibrationMethod method,
                                                          const RecalibrationFiles& files) {
  const bool grouped = method == RecalibrationMethod::groups;
  std::optional<Pixels> before, after;
  std::map<Key, Eigen::Vector3d> places;
  all_mistakes_of([&] { before = load_pixels(files.before, grouped); },
                  [&] { after = load_pixels(files.after, grouped); },
                  [&] {
                    if (!files.points.empty()) places = load_places(files.points);
                  });
  require_partners(*before, *after, files.after);
  require_partners(*after, *before, files.before);
  std::vector<RecalibrationPoint> points;
  for (const Key& key : before->order) {
    const Seen& old_one = before->seen.at(key);
    RecalibrationPoint& point = points.emplace_back();
    point.group = key.first;
    point.name = key.second;
    point.old_px = old_one.u_px;
    point.old_covariance_px2 = old_one.covariance_px2;
    if (const auto partner = after->seen.find(key); partner != after->seen.end()) {
      point.new_px = partner->second.u_px;
      point.new_covariance_px2 = partner->second.covariance_px2;
    }
    if (files.points.empty()) continue;
    if (const auto place = place_of(places, key))
      point.p_mm = *place;
    else
      before->table.add_mistake(old_one.row, "point", words_of(key),
                                concat({"a point that ", files.points.string(), " has"}));
  }
  all_mistakes_of([&] { before->table.throw_if_wrong(); }, [&] { after->table.throw_if_wrong(); });
  return points;
}

}  // namespace zeropose
