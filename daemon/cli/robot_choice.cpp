#include "daemon/cli/robot_choice.h"

#include <algorithm>
#include <stdexcept>

#include "config/text.h"

namespace zeropose::cli {

RobotOptions robot_of_cell(const std::string& path, const std::string& name) {
  const Cell cell = load_cell(path);
  if (name.empty() && cell.robots.size() == 1) return cell.robots.front();
  const auto robot = std::ranges::find(cell.robots, name, &RobotOptions::name);
  if (robot != cell.robots.end()) return *robot;
  std::string known;
  for (const RobotOptions& one : cell.robots) known.append(known.empty() ? "" : ", ").append(one.name);
  throw std::invalid_argument(
      name.empty() ? concat({path, ": has several robots; name one by --robot: ", known})
                   : concat({path, ": has no robot ", in_quotes(name), "; there are: ", known}));
}

}  // namespace zeropose::cli
