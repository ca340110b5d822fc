// zeropose convert: poses and cameras in other systems' forms (spec 92).
#pragma once

#include <optional>
#include <string>

#include "calib/rigid.h"
#include "daemon/cli/verb.h"

namespace zeropose {

void add_convert(cli::Verb app, int& exit_status);

namespace cli {

// The pose of an option's "x,y,z,rx,ry,rz"; nullopt where there is none. Throws ConfigError and
// std::invalid_argument that name the option.
std::optional<Pose> pose_of_option(const std::optional<std::string>& text, const std::string& option);

// The three numbers of an option's "X,Y,Z", mm. Throws likewise.
Eigen::Vector3d place_of_option(const std::string& text, const std::string& option);

// The two numbers of an option's "CX,CY". Throws likewise.
Eigen::Vector2d point_of_option(const std::string& text, const std::string& option);

}  // namespace cli
}  // namespace zeropose
