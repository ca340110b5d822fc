// Owner of a UDP socket's descriptor.
#pragma once

namespace zeropose {

class UdpSocket {
 public:
  UdpSocket();  // throws DeviceError
  ~UdpSocket();
  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&&) = delete;
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

}  // namespace zeropose
