// The loop behind ModbusTcpLink: connections, time limits, and what each request is answered with. Internal.
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include "protocol/modbus_framing.h"
#include "protocol/modbus_reply.h"
#include "protocol/modbus_server.h"
#include "protocol/modbus_socket.h"

namespace zeropose {

class ModbusTcpLink::Server {
 public:
  using Clock = std::chrono::steady_clock;
  using Counter = std::uint64_t ModbusCounters::*;

  Server(const ModbusServerOptions& options, RequestHandler handler);
  ~Server();

  // Runs f(handshake, now) with the link locked, then wakes the loop: its deadline may be another one.
  template <class F>
  void change(F f) {
    locked(f);
    wake();
  }
  std::uint16_t port() const { return port_; }
  ModbusCounters counters();
  ResultBlock block();

 private:
  template <class F>
  void locked(F f) {
    const std::scoped_lock lock(mutex_);
    f(handshake_, Clock::now());
    show_to_tap();
  }
  void show_to_tap();
  void count(Counter counter);
  void wake();

  struct Client {
    Descriptor socket;
    bool may_write = false;
    FrameReader reader;
    TimePoint last_request;
    std::vector<std::uint8_t> unsent;
    bool blocked = false;                    // the peer takes no more: it is not read from
    std::optional<TimePoint> waiting_since;  // for the rest of a request, or for the peer to take an answer
  };

  void run();
  void wait_and_serve();
  std::chrono::milliseconds time_to_wait(TimePoint now);
  bool watch(int fd, std::uint64_t id, std::uint32_t events, int operation);
  void accept_clients(TimePoint now);
  void take_in(Accepted accepted, TimePoint now);
  bool make_room(TimePoint now);
  void close_client(ConnectionId id, Counter why);
  void close_slow_clients(TimePoint now);

  void serve(ConnectionId id, std::uint32_t events);
  void read_from(ConnectionId id, Client& client);
  bool handle_frames(ConnectionId id, Client& client);
  bool send_unsent(ConnectionId id, Client& client);
  std::vector<std::uint8_t> answer(const Adu& request, ConnectionId id, bool may_write);
  std::vector<std::uint8_t> exception(const Adu& request, std::uint8_t number);
  std::vector<std::uint8_t> read_block(const Adu& request);
  std::vector<std::uint8_t> take_command(const Adu& request, ConnectionId id);
  void hand_over(const Request& request);

  const ModbusServerOptions options_;
  const RequestHandler handler_;
  const AllowList allowed_;

  std::mutex mutex_;  // guards the next three
  Handshake handshake_;
  ModbusCounters counters_;
  std::optional<std::uint16_t> tapped_sequence_;

  // Of the loop's thread alone.
  ModbusReply reply_;
  Descriptor listener_, wake_, epoll_;
  std::map<ConnectionId, Client> clients_;
  ConnectionId next_id_ = 2;  // 0 and 1 are the listener's and the wake-up's events
  std::optional<TimePoint> accept_again_at_;

  std::uint16_t port_ = 0;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace zeropose
