// What the verbs about cameras have in common: which camera, its pictures' health, pictures as files.
#pragma once

#include <string>
#include <vector>

#include "daemon/cli/answer.h"
#include "daemon/cli/verb.h"
#include "drivers/camera.h"
#include "measure/picture_health.h"

namespace zeropose::cli {

struct CameraChoice {
  std::string cell, camera, address, device, folder;
  std::vector<int> size;
};

void add_choice(cli::Verb verb, CameraChoice& choice);
// Throws ConfigError of the cell file, std::invalid_argument when the choice names no camera.
CameraOptions chosen_camera(const CameraChoice& choice);

Json health_json(const PictureHealth& health);
std::string health_text(const PictureHealth& health);

// With all its bits. Throws std::runtime_error.
void write_png(const std::string& path, const Frame& frame);

}  // namespace zeropose::cli
