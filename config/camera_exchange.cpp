#include "config/camera_exchange.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "config/csv.h"
#include "config/text.h"

namespace zeropose {
namespace {

constexpr std::array<std::string_view, 3> format_names{"zeropose", "opencv", "ros"};
constexpr int largest_side_px = 65535;

// The names under which a value is known.
struct Keys {
  std::vector<std::string> width{"image_width", "image_Width", "width"};
  std::vector<std::string> height{"image_height", "image_Height", "height"};
  std::vector<std::string> size{"cameraResolution", "image_size"};
  std::vector<std::string> matrix{"camera_matrix", "Camera_Matrix", "cameraMatrix", "K", "k"};
  std::vector<std::string> coefficients{"distortion_coefficients",
                                        "Distortion_Coefficients",
                                        "distortion_coeffs",
                                        "dist_coeffs",
                                        "distCoeffs",
                                        "distortion_coefficents",
                                        "D",
                                        "d"};
  std::vector<std::string> name{"camera_name"};
  std::vector<std::string> model{"distortion_model", "camera_model"};
};

std::string first_of(const std::vector<std::string>& keys) { return keys.front(); }

class Reader {
 public:
  Reader(std::string_view text, std::string file) : file_(std::move(file)) {
    std::string yaml(text);
    // cv::FileStorage writes "%YAML:1.0" where YAML itself wants "%YAML 1.0".
    if (yaml.starts_with("%YAML:")) yaml[5] = ' ';
    try {
      root_ = YAML::Load(yaml);
    } catch (const YAML::Exception& error) {
      fail(error.mark, concat({"a syntax error (", error.msg, ")"}), "YAML");
    }
    if (!root_.IsMap())
      fail(YAML::Mark::null_mark(), "no keys", "a YAML map with image_width, camera_matrix");
  }

  // The value under one of the names; an undefined node where there is none.
  YAML::Node find(const std::vector<std::string>& keys) const {
    YAML::Node found(YAML::NodeType::Undefined);
    for (const auto& member : root_) {
      const std::string key = member.first.IsScalar() ? member.first.Scalar() : "";
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) continue;
      if (found.IsDefined()) fail(member.first.Mark(), concat({in_quotes(key), " again"}), "it once");
      found.reset(member.second);
    }
    return found;
  }

  YAML::Node demand(const std::vector<std::string>& keys) const {
    const YAML::Node found = find(keys);
    if (!found.IsDefined())
      fail(YAML::Mark::null_mark(), concat({"no key ", first_of(keys)}),
           "it (or a name that OpenCV gives it)");
    return found;
  }

  double number(const YAML::Node& node, const std::string& what) const {
    double value = 0;
    std::string text = node.IsScalar() ? node.Scalar() : "no number";
    if (text.ends_with('.')) text += '0';  // cv::FileStorage writes "1250."
    if (!parse_number(text, value))
      fail(node.Mark(), in_quotes(text), concat({"a finite number for ", what}));
    return value;
  }

  int whole(const YAML::Node& node, const std::string& what, int least, int most) const {
    const double value = number(node, what);
    if (value != std::floor(value) || value < least || value > most)
      fail(node.Mark(), node.Scalar(),
           concat({what, ": an integer from ", std::to_string(least), " to ", std::to_string(most)}));
    return static_cast<int>(value);
  }

  // {rows, cols, data: [...]} row by row, or the bare sequence.
  std::vector<double> matrix(const YAML::Node& node, const std::string& what) const {
    const YAML::Node data = node.IsMap() ? node["data"] : node;
    if (!data.IsDefined() || !data.IsSequence())
      fail(node.Mark(), "no list", concat({what, ": rows, cols and data [..]"}));
    std::vector<double> values;
    for (const auto& row : data)
      if (row.IsSequence())
        for (const auto& value : row) values.push_back(number(value, what));
      else
        values.push_back(number(row, what));
    if (node.IsMap() && node["rows"].IsDefined() && node["cols"].IsDefined()) {
      const int rows = whole(node["rows"], concat({what, ".rows"}), 0, 100);
      const int columns = whole(node["cols"], concat({what, ".cols"}), 0, 100);
      if (static_cast<std::size_t>(rows * columns) != values.size())
        fail(data.Mark(), concat({std::to_string(values.size()), " numbers"}),
             concat({what, ": rows x cols = ", std::to_string(rows * columns)}));
    }
    return values;
  }

  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& found,
                         const std::string& expected) const {
    const std::string line = mark.is_null() ? "" : concat({":", std::to_string(mark.line + 1)});
    throw ConfigError({concat({file_, line, ": found ", found, ", expected ", expected})});
  }

 private:
  std::string file_;
  YAML::Node root_;
};

void read_size(const Reader& reader, const Keys& keys, ImageSize size, CameraModel& camera) {
  camera.width_px = size.width_px;
  camera.height_px = size.height_px;
  if (const YAML::Node both = reader.find(keys.size);
      both.IsDefined() && both.IsSequence() && both.size() == 2) {
    camera.width_px = reader.whole(both[0], "width", 1, largest_side_px);
    camera.height_px = reader.whole(both[1], "height", 1, largest_side_px);
    return;
  }
  const bool known = size.width_px > 0 && size.height_px > 0;
  const auto side = [&](const std::vector<std::string>& names, int& value) {
    const YAML::Node node = known ? reader.find(names) : reader.demand(names);
    if (node.IsDefined()) value = reader.whole(node, first_of(names), 1, largest_side_px);
  };
  side(keys.width, camera.width_px);
  side(keys.height, camera.height_px);
}

void read_matrix(const Reader& reader, const Keys& keys, CameraModel& camera) {
  const YAML::Node node = reader.demand(keys.matrix);
  const std::vector<double> m = reader.matrix(node, first_of(keys.matrix));
  if (m.size() != 9) reader.fail(node.Mark(), std::to_string(m.size()) + " numbers", "a 3 x 3 camera matrix");
  const bool no_skew = m[1] == 0 && m[3] == 0 && m[6] == 0 && m[7] == 0 && m[8] == 1;
  if (!no_skew || !(m[0] > 0) || !(m[4] > 0))
    reader.fail(node.Mark(), "another matrix",
                "[fx, 0, cx, 0, fy, cy, 0, 0, 1] with fx, fy above 0 (a skew is not supported)");
  camera.fx_px = m[0];
  camera.cx_px = m[2];
  camera.fy_px = m[4];
  camera.cy_px = m[5];
}

// OpenCV's order: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]].
void read_coefficients(const Reader& reader, const Keys& keys, CameraModel& camera) {
  const YAML::Node node = reader.demand(keys.coefficients);
  const std::vector<double> d = reader.matrix(node, first_of(keys.coefficients));
  constexpr std::array<std::size_t, 6> counts{0, 4, 5, 8, 12, 14};
  if (std::find(counts.begin(), counts.end(), d.size()) == counts.end())
    reader.fail(node.Mark(), std::to_string(d.size()) + " coefficients", "4 or 5: k1 k2 p1 p2 k3");
  if (std::any_of(d.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(5, d.size())), d.end(),
                  [](double value) { return value != 0; }))
    reader.fail(node.Mark(), "coefficients beyond k1 k2 p1 p2 k3 that are not 0",
                "a Brown-Conrady model: calibrate without the rational, thin prism and tilted models");
  const auto at = [&](std::size_t i) { return i < d.size() ? d[i] : 0; };
  camera.distortion = BrownConrady{at(0), at(1), at(2), at(3), at(4)};
}

void refuse_other_models(const Reader& reader, const Keys& keys) {
  if (const YAML::Node fisheye = reader.find({"fisheye_model"}); fisheye.IsDefined())
    if (reader.number(fisheye, "fisheye_model") != 0)
      reader.fail(fisheye.Mark(), "a fisheye model", "a Brown-Conrady model (k1 k2 p1 p2 k3)");
  const YAML::Node model = reader.find(keys.model);
  if (!model.IsDefined()) return;
  const std::string name = model.IsScalar() ? model.Scalar() : "no name";
  // rational_polynomial with k4 = k5 = k6 = 0 is the same model; read_coefficients() looks.
  if (name != "plumb_bob" && name != "rational_polynomial")
    reader.fail(model.Mark(), concat({"the distortion model ", in_quotes(name)}),
                "plumb_bob (k1 k2 p1 p2 k3)");
}

// A message may speak of a part of the image, or of binned pixels.
void refuse_part_of_image(const Reader& reader) {
  for (const char* key : {"binning_x", "binning_y"})
    if (const YAML::Node binning = reader.find({key}); binning.IsDefined())
      if (reader.number(binning, key) > 1)
        reader.fail(binning.Mark(), concat({key, " ", binning.Scalar()}), "an image without binning");
  const YAML::Node roi = reader.find({"roi"});
  if (!roi.IsDefined() || !roi.IsMap()) return;
  for (const char* key : {"x_offset", "y_offset"})
    if (roi[key].IsDefined() && reader.number(roi[key], key) != 0)
      reader.fail(roi.Mark(), "a region of interest", "the whole image");
}

// The shortest text that reads back to the same number, always with a point or an exponent.
std::string exact(double value) {
  std::array<char, 40> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  std::string number(text.data(), end);
  if (number.find_first_of(".e") == std::string::npos) number += ".0";
  return number;
}

std::string matrix_text(std::string_view key, int rows, int columns, std::span<const double> values,
                        bool opencv) {
  std::string text =
      concat({key, opencv ? ": !!opencv-matrix\n" : ":\n", "  rows: ", std::to_string(rows),
              "\n  cols: ", std::to_string(columns), opencv ? "\n  dt: d" : "", "\n  data: ["});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool new_row = i > 0 && i % static_cast<std::size_t>(std::max(columns, 3)) == 0;
    text += concat({i == 0 ? "" : (new_row ? ",\n         " : ", "), exact(values[i])});
  }
  return text + "]\n";
}

const BrownConrady& brown_of(const CameraModel& camera) {
  const auto* brown = std::get_if<BrownConrady>(&camera.distortion);
  if (brown == nullptr) throw std::invalid_argument("a division model must be converted to brown before");
  return *brown;
}

std::string size_text(const CameraModel& camera) {
  return concat({"image_width: ", std::to_string(camera.width_px),
                 "\nimage_height: ", std::to_string(camera.height_px), "\n"});
}

std::array<double, 9> matrix_of(const CameraModel& camera) {
  return {camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1};
}

// A name that YAML could take for something else stands in quotes.
std::string scalar_text(const std::string& name) {
  const auto plain = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto inside = [&](char c) { return plain(c) || (c >= '0' && c <= '9') || c == '/' || c == '-'; };
  constexpr std::array<std::string_view, 10> words{"y",   "n",    "yes",   "no",   "on",
                                                   "off", "true", "false", "null", "nan"};
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c); });
  const bool is_plain = !name.empty() && plain(name.front()) &&
                        std::all_of(name.begin(), name.end(), inside) &&
                        std::find(words.begin(), words.end(), lower) == words.end();
  return is_plain ? name : nlohmann::json(name).dump();
}

}  // namespace

std::string_view name_of(CameraFormat format) { return format_names[static_cast<std::size_t>(format)]; }

std::optional<CameraFormat> camera_format_named(std::string_view name) {
  for (std::size_t i = 0; i < format_names.size(); ++i)
    if (format_names[i] == name) return static_cast<CameraFormat>(i);
  return std::nullopt;
}

CalibratedCamera parse_yaml_camera(std::string_view text, const std::string& file, ImageSize size) {
  const Reader reader(text, file);
  const Keys keys;
  CalibratedCamera camera;
  refuse_other_models(reader, keys);
  refuse_part_of_image(reader);
  read_size(reader, keys, size, camera.model);
  read_matrix(reader, keys, camera.model);
  read_coefficients(reader, keys, camera.model);
  if (const YAML::Node name = reader.find(keys.name); name.IsDefined() && name.IsScalar())
    camera.name = name.Scalar();
  return camera;
}

std::string opencv_camera_text(const CameraModel& camera) {
  const BrownConrady& lens = brown_of(camera);
  const std::array<double, 5> d{lens.k1, lens.k2, lens.p1, lens.p2, lens.k3};
  return concat({"%YAML:1.0\n---\n", size_text(camera),
                 matrix_text("camera_matrix", 3, 3, matrix_of(camera), true),
                 matrix_text("distortion_coefficients", 5, 1, d, true)});
}

std::string ros_camera_text(const CameraModel& camera, const std::string& name) {
  const BrownConrady& lens = brown_of(camera);
  const std::array<double, 5> d{lens.k1, lens.k2, lens.p1, lens.p2, lens.k3};
  const std::array<double, 9> unit{1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::array<double, 12> projection{
      camera.fx_px, 0, camera.cx_px, 0, 0, camera.fy_px, camera.cy_px, 0, 0, 0, 1, 0};
  return concat({size_text(camera), "camera_name: ", scalar_text(name), "\n",
                 matrix_text("camera_matrix", 3, 3, matrix_of(camera), false),
                 "distortion_model: plumb_bob\n", matrix_text("distortion_coefficients", 1, 5, d, false),
                 matrix_text("rectification_matrix", 3, 3, unit, false),
                 matrix_text("projection_matrix", 3, 4, projection, false)});
}

}  // namespace zeropose
