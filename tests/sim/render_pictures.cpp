// Writes rendered pictures to files, for the check in projection_check.py and for docs/images.
//
//   render_pictures CELL.json CELL.sim.json FOLDER [flat] [straight] [noisy] < poses
//   render_pictures CELL.json CELL.sim.json wrong-calibration SEED > CELL.calibration.json
//
// One pose X_WO as six numbers per line. Pictures are FOLDER/CAMERA-LINE.f32 (floats without noise) or, when
// noisy, .pgm. flat: no clutter, no illumination gradient; straight: lenses without distortion.
#include <fstream>
#include <iostream>
#include <set>

#include "config/cell.h"
#include "sim/renderer.h"
#include "sim/sim_file.h"
#include "sim/wrong_calibration.h"

namespace {

using namespace zeropose;

void write_floats(const std::string& path, const std::vector<float>& picture) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(picture.data()),
             static_cast<std::streamsize>(picture.size() * sizeof(float)));
}

void write_pgm(const std::string& path, const CameraModel& camera, const std::vector<float>& picture,
               double sigma_grey, std::uint64_t state) {
  std::vector<std::uint8_t> pixels(picture.size());
  add_noise(picture, sigma_grey, state, pixels);
  std::ofstream file(path, std::ios::binary);
  file << "P5\n" << camera.width_px << ' ' << camera.height_px << "\n255\n";
  file.write(reinterpret_cast<const char*>(pixels.data()), static_cast<std::streamsize>(pixels.size()));
}

void render_all(const Scene& scene, const std::string& folder, bool noisy) {
  SixNumbers six;
  for (int line = 0; std::cin >> six.x_mm >> six.y_mm >> six.z_mm >> six.rx_deg >> six.ry_deg >> six.rz_deg;
       ++line) {
    for (std::size_t camera = 0; camera < scene.cameras.size(); ++camera) {
      const std::vector<float> picture = CameraRenderer(scene, camera).clean_picture(from_six_numbers(six));
      const std::string path = folder + "/" + scene.cameras[camera].name + "-" + std::to_string(line);
      if (noisy)
        write_pgm(path + ".pgm", scene.cameras[camera].model, picture, scene.picture.noise_sigma_grey,
                  camera + 1);
      else
        write_floats(path + ".f32", picture);
    }
  }
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 3) {
    std::cerr << "render_pictures CELL.json CELL.sim.json FOLDER [flat] [straight] [noisy]\n";
    return 2;
  }
  if (arguments[2] == "wrong-calibration") {
    const SimFile truth = load_sim_file(arguments[1]);
    std::cout << calibration_text(wrong_calibration(truth.cameras, {}, std::stoull(arguments.at(3))),
                                  "What the daemon believes: the true cameras of " +
                                      std::filesystem::path(arguments[1]).filename().string() +
                                      " with the errors of wrong_calibration(), seed " + arguments[3] + ".");
    return 0;
  }
  const std::set<std::string> options(arguments.begin() + 3, arguments.end());
  Scene scene = load_scene(load_cell(arguments[0]), arguments[1]);
  if (options.contains("flat")) scene.picture.clutter = 0, scene.picture.illumination_gradient = 0;
  if (options.contains("straight"))
    for (CalibratedCamera& camera : scene.cameras) camera.model.distortion = Division{};
  render_all(scene, arguments[2], options.contains("noisy"));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
