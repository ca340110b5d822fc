// The loop behind ModbusTcpServer: connections, time limits, and what each request is answered with.
// Internal.
#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "protocol/modbus_framing.h"
#include "protocol/modbus_reply.h"
#include "protocol/modbus_server.h"
#include "protocol/modbus_socket.h"
#include "protocol/modbus_unit.h"

namespace zeropose {

class ModbusTcpServer::Loop {
 public:
  using Clock = std::chrono::steady_clock;
  using Counter = std::uint64_t ModbusCounters::*;

  Loop(const ModbusServerOptions& options, const std::vector<Served>& robots);
  ~Loop();

  std::uint16_t port() const { return port_; }
  ModbusCounters counters();

 private:
  struct Robot {
    std::uint8_t unit;
    RobotEndpoint& endpoint;
    AllowList allowed;
    ModbusUnitServer server;
  };
  struct Client {
    Descriptor socket;
    in_addr_t peer = 0;
    bool listed = false;  // a writer by name: has a place reserved
    UnitSet writable;     // of the units that it may reach
    FrameReader reader;
    TimePoint last_request;
    std::vector<std::uint8_t> unsent;
    bool blocked = false;                    // the peer takes no more: it is not read from
    std::optional<TimePoint> waiting_since;  // for the rest of a request, or for the peer to take an answer
  };

  void count(Counter counter);
  void wake();
  void run();
  void wait_and_serve();
  std::chrono::milliseconds time_to_wait(TimePoint now) const;
  bool watch(int fd, std::uint64_t id, std::uint32_t events, int operation);
  void accept_clients(TimePoint now);
  void take_in(Accepted accepted, TimePoint now);
  std::size_t places_reserved_for_others(const Client& client) const;
  bool make_room_for(const Client& client, TimePoint now);
  void close_client(ConnectionId id, Counter why);
  void close_slow_clients(TimePoint now);

  void serve(ConnectionId id, std::uint32_t events);
  void read_from(ConnectionId id, Client& client);
  bool handle_frames(ConnectionId id, Client& client);
  bool send_unsent(ConnectionId id, Client& client);
  std::vector<std::uint8_t> answer(const Adu& request, ConnectionId id, const Client& client);

  const ModbusServerOptions options_;
  std::vector<Robot> robots_;
  std::set<in_addr_t> listed_;  // writers of all robots

  std::mutex mutex_;  // guards the next one
  ModbusCounters counters_;

  // Of the loop's thread alone.
  ModbusReply reply_;
  Descriptor listener_, wake_, epoll_;
  std::map<ConnectionId, Client> clients_;
  std::optional<TimePoint> accept_again_at_;

  std::uint16_t port_ = 0;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace zeropose
