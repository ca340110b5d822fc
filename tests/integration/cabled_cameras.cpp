#include "tests/integration/cabled_cameras.h"

#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "sim/gige_server.h"
#include "tests/drivers/numbered_cameras.h"
#include "tests/support/netns.h"

namespace zeropose {
namespace {

std::string text(int number) { return std::to_string(number); }
std::string cable(int camera) { return "cable" + text(camera); }
std::string host_address(int camera) { return "10.77." + text(camera) + ".1"; }
std::string camera_address(int camera) { return "10.77." + text(camera) + ".2"; }

bool run(const std::string& command) { return std::system((command + " 2>/dev/null").c_str()) == 0; }

struct Peer {
  pid_t pid = -1;
  int to = -1, from = -1;  // lines of text
};
Peer peer;

void send_line(int fd, const std::string& line) {
  const std::string whole = line + "\n";
  if (::write(fd, whole.data(), whole.size()) != static_cast<ssize_t>(whole.size()))
    throw std::runtime_error("the cameras' process is gone");
}

std::string receive_line(int fd) {
  std::string line;
  for (char c = 0; ::read(fd, &c, 1) == 1 && c != '\n';) line += c;
  return line;
}

// The cameras' side: plugs them in when it is told that the cables are there, then carries out "lose CAMERA
// RATIO" until its input ends.
void serve(int from, int to) {
  if (::unshare(CLONE_NEWNET) != 0) return send_line(to, "no second network");
  send_line(to, "ready");
  receive_line(from);
  std::vector<ServedCamera> cameras;
  for (int i = 0; i < CabledCameras::count; ++i) {
    run("ip addr add " + camera_address(i) + "/24 dev plug" + text(i));
    run("ip link set plug" + text(i) + " up");
    ServedCamera camera;
    camera.name = "camera" + text(i);
    camera.address = camera_address(i);
    camera.width_px = CabledCameras::width_px;
    camera.height_px = CabledCameras::height_px;
    cameras.push_back(camera);
  }
  std::atomic<std::uint64_t> drawn = 0;
  GigeServer server(cameras, [&drawn](std::size_t camera, std::span<std::uint8_t> pixels) {
    const PictureNumber number{drawn / 4, ++drawn, camera};
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = pixel_of(number.scene, i);
    std::memcpy(pixels.data(), &number, sizeof number);
  });
  send_line(to, "serving");
  for (std::string line = receive_line(from); !line.empty(); line = receive_line(from)) {
    int camera = 0;
    double ratio = 0;
    if (std::sscanf(line.c_str(), "lose %d %lf", &camera, &ratio) == 2)
      server.lose_packets(static_cast<std::size_t>(camera), ratio);
    send_line(to, "done");
  }
}

bool lay_cable(int camera) {
  return run("ip link add " + cable(camera) + " type veth peer name plug" + text(camera) + " netns " +
             text(peer.pid)) &&
         run("ip addr add " + host_address(camera) + "/24 dev " + cable(camera)) &&
         run("ip link set " + cable(camera) + " up");
}

}  // namespace

std::string CabledCameras::plug_in() {
  if (const std::string impossible = enter_private_network({}); !impossible.empty()) return impossible;
  std::array<int, 2> down{}, up{};
  if (::pipe(down.data()) != 0 || ::pipe(up.data()) != 0) return "no pipe";
  peer.pid = ::fork();
  if (peer.pid == 0) {
    ::close(down[1]);
    serve(down[0], up[1]);
    ::_exit(0);
  }
  ::close(down[0]);
  peer.to = down[1];
  peer.from = up[0];
  if (receive_line(peer.from) != "ready") return "no second private network";
  for (int i = 0; i < count; ++i)
    if (!lay_cable(i)) return "no veth pair between two networks";
  send_line(peer.to, "cables are there");
  return receive_line(peer.from) == "serving" ? "" : "the simulated cameras did not start";
}

void CabledCameras::end() {
  ::close(peer.to);
  if (peer.pid > 0) ::waitpid(peer.pid, nullptr, 0);
}

CameraOptions CabledCameras::options(int camera) {
  CameraOptions options;
  options.name = "camera" + text(camera);
  options.gige.address = camera_address(camera);
  options.width_px = width_px;
  options.height_px = height_px;
  return options;
}

void CabledCameras::pull(int camera) {
  if (!run("ip link set " + cable(camera) + " down")) throw std::runtime_error("the cable is stuck");
}

void CabledCameras::plug(int camera) {
  if (!run("ip link set " + cable(camera) + " up")) throw std::runtime_error("the cable does not fit");
}

void CabledCameras::lose_packets(int camera, double ratio) {
  send_line(peer.to, "lose " + text(camera) + " " + std::to_string(ratio));
  receive_line(peer.from);
}

}  // namespace zeropose
