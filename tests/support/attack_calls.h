// The calls that attacks are made of. Thread rule: any thread.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tessera/v1/instance.pb.h"
#include "tests/support/attacks.h"
#include "trust/credentials.h"

namespace tessera::support {

#if defined(__SANITIZE_THREAD__)
inline constexpr std::chrono::seconds kAttackPatience{120};  // the attacker is as slow as all else
#else
inline constexpr std::chrono::seconds kAttackPatience{20};
#endif
inline constexpr char kHealthCheck[] = "/grpc.health.v1.Health/Check";

inline std::chrono::system_clock::time_point Soon() { return std::chrono::system_clock::now() + kAttackPatience; }

// A connection of its own for each call, so that none waits for another's.
std::shared_ptr<grpc::Channel> DialAlone(const std::string& address, const trust::Credentials& credentials = {});
// The outcome of a call by its name, with these bytes as its request.
grpc::Status CallByName(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                        const std::string& request = "");
// "/tessera.v1.HostService/ListHosts", ...: all that are served at a door, and one that is not.
std::vector<std::string> AllMethodNames();
// The caller has no right, or proved nothing.
bool IsRefusal(const grpc::Status& status);
// As this user, by the socket.
v1::Instance GetInstance(const Target& target, const std::string& id);

// Runs `act(i)` for i below `count`, each on a thread of its own.
template <class Act>
void InParallel(int count, const Act& act) {
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) threads.emplace_back([&act, i] { act(i); });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace tessera::support
