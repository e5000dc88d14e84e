// Hosts: which machines belong to the cluster, whose agent is attached, and which of them are heard.
//
// A host is added with a join token, which admits one agent once and runs out; from then on its secret does. The latest
// stream of an agent counts. A host that is silent for `lost_after` is lost until its next word.
//
// Thread rule: as Cluster.
#pragma once

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/control_settings.h"
#include "control_plane/now.h"
#include "control_plane/secrets.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/host.pb.h"

namespace tessera::control {

struct Admission {
  StreamId stream = 0;
  v1::Admitted admitted;  // without certificates, which the caller makes
  std::string serial;     // serial of the certificate that is to be made; empty: none was requested, or none is left
};

class Hosts {
 public:
  Hosts(ClusterState& state, const ControlSettings& settings, RandomBytes random);

  // Errors: INVALID_ARGUMENT, ALREADY_EXISTS, NOT_FOUND, FAILED_PRECONDITION, naming the field.
  absl::StatusOr<v1::AddHostResponse> Add(const v1::AddHostRequest& request, Now now);
  absl::StatusOr<v1::DrainHostResponse> Drain(const v1::DrainHostRequest& request);
  // The host that the request names, which may be removed. Errors: NOT_FOUND, FAILED_PRECONDITION.
  absl::StatusOr<HostEntry*> FindRemovable(const v1::RemoveHostRequest& request);
  // `touched`: instances that ran on it, so that it is evicted.
  absl::Status Remove(HostEntry& host, InstanceNumbers& touched);

  // Admits an agent and opens its stream. `shown_serial`: that of its certificate, empty for a socket and with a join
  // token; certificates of the host before that one are worth nothing from then on. UNAUTHENTICATED, PERMISSION_DENIED
  // (the host was removed), INVALID_ARGUMENT.
  // A join token counts until an agent has shown that the answer came, for that may be lost: by the secret in it, or by
  // a message on the stream (NoteSecretCame). Until then whoever shows it again takes the place of the one before.
  absl::StatusOr<Admission> Admit(const v1::AgentHello& hello, Now now, const std::string& shown_serial = "");

  void NoteSecretCame(HostEntry& host);

  // The native games that an admitted host has from now on. UNAVAILABLE: it is not stored, and is to be sent again.
  absl::Status NoteModules(HostEntry& host, const v1::GameModuleList& modules);

  // The host was loaded: nobody is lost before there was time to be heard.
  void Adopt(HostEntry& host, Now now) { host.last_heard = any_heard_ = now.steady; }
  // How long this process itself stood still before `now`, if it did: it heard nobody meanwhile, which is no silence of
  // theirs. Call it before anything is made of what came meanwhile, of which the first may be old.
  Steady OwnPause(Now now);
  // For how long nobody at all was heard before this message, if that is long: so far it is this process that was cut
  // off, and nobody else's silence. Call it before Heard.
  Steady OwnDeafness(Now now);
  // A message came. True: the host was lost until now.
  bool Heard(HostEntry& host, Now now);
  void NoteHeartbeat(HostEntry& host, const v1::AgentHeartbeat& heartbeat, Now now);
  // A worker of the host ended. Where it had found no free ports, regions go elsewhere for a while.
  void NoteExit(HostEntry& host, const v1::WorkerExited& exited, Now now);
  // Call it about every kTimerInterval.
  void ForgetNoPorts(HostEntry& host, Now now);
  // True: the host has been silent for too long, and is lost from now on.
  bool Lost(HostEntry& host, Now now);

 private:
  absl::StatusOr<HostEntry*> Authenticate(const v1::AgentHello& hello, Now now);
  absl::Status TakeSerial(const HostEntry& host, const std::string& shown, records::Host& next);
  void Forgive(Steady span, Now now);
  void WarnOfLoopback(const HostEntry& host, bool moved);

  ClusterState& state_;
  ControlSettings settings_;
  RandomBytes random_;
  Steady last_call_{0};  // 0: not yet
  Steady any_heard_{0};  // when some host was
};

// INVALID_ARGUMENT "hello.join_token: has 4096 bytes, at most 256". What it takes does not grow with what is too long.
absl::Status CheckHello(const v1::AgentHello& hello);
// Names are unique; an id is taken for one only where no host has it as its name. Null: there is none.
const HostEntry* FindHostByName(const ClusterState& state, const std::string& name_or_id);
absl::Status NoHost(const std::string& name);
v1::HostState StateOf(const HostEntry& host);
// How many regions it may be given, and is: as many as it says that it takes, as far as it may.
std::uint32_t MaxRegionsOf(const HostEntry& host);
std::uint32_t CapacityOf(const HostEntry& host);
v1::Host ViewOf(const HostEntry& host);
// True if some host is reached by an address that is not of its own machine alone.
bool ReachesOtherMachines(const ClusterState& state);
// Adds what is wrong with the host, for whoever lists it. `reaches`: as ReachesOtherMachines.
void AddNotes(const HostEntry& host, bool reaches, v1::Host& view);
// UNAUTHENTICATED unless `serial` is of the newest certificate that the host has shown, or of a later one.
absl::Status CheckHostCertificate(const ClusterState& state, const std::string& host_id, const std::string& serial);
// UNAUTHENTICATED unless the secret is that of the host.
absl::Status CheckHostSecret(const ClusterState& state, const std::string& host_id, const std::string& secret);

}  // namespace tessera::control
