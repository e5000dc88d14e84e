// The doors of a control plane over real TLS: strangers, tokens, hosts and players, each at each.
#include "control_plane/doors.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpc/grpc.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <condition_variable>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/door_limits.h"
#include "control_plane/doors_fixture.h"
#include "control_plane/grpc_server.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"
#include "tessera/v1/visuals.grpc.pb.h"

namespace tessera::control {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

TEST_F(DoorsTest, TheSocketIsThisUsersAndMayDoAll) {
  struct stat found {};
  ASSERT_EQ(stat((folder_.path() + "/control.sock").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600u);
  EXPECT_TRUE(AddHost(Socket(), "alpha").ok());
  EXPECT_TRUE(ListHosts(Socket()).ok());
}

TEST_F(DoorsTest, AStrangerGetsNothing) {
  EXPECT_EQ(ListHosts(Operators()).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(AddHost(Operators(), "alpha").error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Join(Operators(), true).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(ListHosts(Operators("tsa_" + std::string(64, '0'))).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(ListHosts(Operators(std::string(4096, 'x'))).error_code(), StatusCode::UNAUTHENTICATED);
}

TEST_F(DoorsTest, AJoinTokenMustBeShownBeforeAHelloIsRead) {
  std::string token;
  ASSERT_TRUE(AddHost(Socket(), "alpha", &token).ok());
  token.resize(token.find('.'));
  v1::AgentHello hello = PlainHello();
  hello.set_join_token(token);
  hello.set_certificate_request(*trust::MakeRequest(*trust::MakeKey()));
  const auto refusal = [&hello](const std::shared_ptr<grpc::Channel>& channel) {
    const grpc::Status status = Hello(channel, hello, nullptr);
    EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
    return status.error_message();
  };
  EXPECT_THAT(refusal(Operators()), HasSubstr("a host's certificate or its join token is needed"));
  EXPECT_THAT(refusal(Operators(Token("ada", v1::ROLE_ADMINISTRATOR))), HasSubstr("its join token is needed"));
  EXPECT_EQ(refusal(Operators("tsj_" + std::string(64, '0'))), "hello.join_token: unknown, or used already");
  v1::AgentHello without = hello;
  without.clear_certificate_request();
  EXPECT_EQ(Hello(Operators(token), without, nullptr).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(Hello(Operators(token), hello, nullptr).ok());
  const Host host = JoinWith(token);  // nobody has shown yet that the answer came
  EXPECT_TRUE(Hello(Dialled(server_->operators(), host.credentials), HelloOf(host), nullptr).ok());
  EXPECT_EQ(refusal(Operators(token)), "hello.join_token: unknown, or used already");
}

// Whatever it says, of whatever length: its call ends before that is read.
// Answers of a call whose request is `bytes`, whether they can be parsed or not.
grpc::Status CallWithBytes(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                           const std::string& bytes) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  const grpc::Slice slice(bytes);
  const auto call = stub.PrepareUnaryCall(&context, path, grpc::ByteBuffer(&slice, 1), &queue);
  call->StartCall();
  grpc::ByteBuffer answer;
  grpc::Status status;
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return status;
}

TEST_F(DoorsTest, ARequestIsMeasuredByItsMethodBeforeAnythingOfItIsParsed) {
  // Never undone: after a write that had to wait, gRPC's end waits for up to 10 s for a poll that it began for that.
  grpc_init();
  const auto socket = Socket();
  int small = 0;
  for (const char* service : {v1::AccessService::service_full_name(), v1::HostService::service_full_name(),
                              v1::InstanceService::service_full_name(), v1::SessionService::service_full_name(),
                              v1::VisualService::service_full_name(), v1::AgentLinkService::service_full_name()}) {
    const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
    ASSERT_NE(descriptor, nullptr) << service;
    for (int i = 0; i < descriptor->method_count(); ++i) {
      const std::string name = absl::StrCat(descriptor->name(), "/", descriptor->method(i)->name());
      const std::size_t limit = RequestLimit(name);
      if (descriptor->method(i)->client_streaming() || limit == std::size_t{kMaxMessageBytes}) continue;
      small += limit == kRequestBytes ? 1 : 0;
      const grpc::Status status =
          CallWithBytes(socket, absl::StrCat("/tessera.v1.", name), std::string(limit + 1, '\xff'));
      EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED) << name << ": " << status.error_message();
      EXPECT_EQ(status.error_message(), absl::StrCat(name, ": the request has ", limit + 1, " bytes, at most ", limit));
    }
  }
  EXPECT_GE(small, 30);
}

// 2 bytes each, as 4 million empty messages of a repeated field have them.
std::string EmptyMessages(int field, int count) {
  std::string bytes;
  for (int i = 0; i < count; ++i) bytes += {static_cast<char>(field << 3 | 2), 0};
  return bytes;
}

template <class Message>
void AddRaw(Message& message, int field, const std::string& bytes) {
  message.GetReflection()->MutableUnknownFields(&message)->AddLengthDelimited(field, bytes);
}

TEST_F(DoorsTest, ARequestThatWouldTakeGigabytesIsNotParsed) {
  v1::CreateInstanceRequest create;
  AddRaw(*create.mutable_spec(), v1::InstanceSpec::kSceneFieldNumber,
         EmptyMessages(v1::Scene::kBodiesFieldNumber, 4'000'000));
  v1::CreateInstanceResponse created;
  grpc::ClientContext context;
  const grpc::Status status = v1::InstanceService::NewStub(Socket())->CreateInstance(&context, create, &created);
  EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(status.error_message(),
            "InstanceService/CreateInstance: the request would take more than 256 MiB of memory");
}

TEST_F(DoorsTest, MessagesOfStreamsAreMeasuredBeforeTheyAreParsed) {
  const auto socket = Socket();
  const std::string piece(2 * kPieceBytes, 'x');
  const auto instances = v1::InstanceService::NewStub(socket);
  const auto agents = v1::AgentLinkService::NewStub(socket);
  const auto visuals = v1::VisualService::NewStub(socket);
  const auto expect_refused = [&](auto& stub, auto call, auto request, auto response, std::size_t most) {
    grpc::ClientContext context;
    request.set_data(piece);
    const auto stream = (stub.*call)(&context, &response);
    stream->Write(request);
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat("at most ", most + kAroundPieceBytes)));
  };
  expect_refused(*instances, &v1::InstanceService::Stub::ImportCheckpoint, v1::ImportCheckpointRequest(),
                 v1::ImportCheckpointResponse(), kPieceBytes);
  expect_refused(*agents, &v1::AgentLinkService::Stub::UploadCheckpoint, v1::UploadCheckpointRequest(),
                 v1::UploadCheckpointResponse(), kPieceBytes);
  expect_refused(*visuals, &v1::VisualService::Stub::PutVisual, v1::PutVisualRequest(), v1::PutVisualResponse(),
                 kVisualPieceBytes);
  v1::AgentMessage hollow;
  AddRaw(hollow, v1::AgentMessage::kHeartbeatFieldNumber,
         EmptyMessages(v1::AgentHeartbeat::kWorkersFieldNumber, 2'000'000));
  grpc::ClientContext context;
  const auto stream = agents->Attach(&context);
  stream->Write(hollow);
  v1::ControlMessage answer;
  EXPECT_FALSE(stream->Read(&answer));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("would take too much memory"));
}

TEST_F(DoorsTest, ARequestWithinItsLimitIsLookedAtAndASceneMayBeLarge) {
  const auto administrator = Operators(Token("ada", v1::ROLE_ADMINISTRATOR));
  const auto pad = [](google::protobuf::Message& message, std::size_t bytes) {  // with a field of a later release
    constexpr int kNoFieldYet = 1000;
    message.GetReflection()->MutableUnknownFields(&message)->AddLengthDelimited(kNoFieldYet, std::string(bytes, 'x'));
  };
  v1::ListHostsRequest list;
  pad(list, kRequestBytes - 16);
  v1::ListHostsResponse hosts;
  grpc::ClientContext asked;
  EXPECT_TRUE(v1::HostService::NewStub(administrator)->ListHosts(&asked, list, &hosts).ok());
  v1::CreateInstanceRequest create;
  pad(*create.mutable_spec()->mutable_scene(), 4 * kGameRequestBytes);
  v1::CreateInstanceResponse created;
  grpc::ClientContext made;
  const auto instances = v1::InstanceService::NewStub(administrator);
  EXPECT_EQ(instances->CreateInstance(&made, create, &created).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(CallWithBytes(Operators(), "/tessera.v1.InstanceService/GetInstance", std::string(kRequestBytes + 1, 'x'))
                .error_code(),
            StatusCode::UNAUTHENTICATED)
      << "who has shown nothing is refused for that";
}

TEST_F(DoorsTest, AStrangersLongRequestsAreNotRead) {
  v1::AgentHello hello = PlainHello();
  hello.set_join_token(std::string(std::size_t{32} << 20, 'x'));
  EXPECT_THAT(Hello(Operators(), hello, nullptr).error_message(), HasSubstr("its join token is needed"));
  const auto ask_health = [](const std::shared_ptr<grpc::Channel>& channel, std::size_t bytes) {
    return CallWithBytes(channel, "/grpc.health.v1.Health/Check", std::string(bytes, 'x')).error_code();
  };
  EXPECT_EQ(ask_health(Operators(), std::size_t{32} << 20), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(ask_health(Players(), kPlayersMessageBytes + 1), StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(DoorsTest, APlayerFindsWhoeverServesOfSeveral) {
  const std::string authority = "#" + authority_.fingerprint;
  // Nobody listens at the first.
  const auto channel = Dialled("127.0.0.1:1" + authority + "," + server_->players() + authority, {});
  EXPECT_EQ(Join(channel, false).error_code(), StatusCode::NOT_FOUND) << "there is no such world; but somebody says so";
}

TEST_F(DoorsTest, PlainTextIsNoWayIn) {
  for (const std::string& address : {server_->operators(), server_->players()}) {
    const auto channel = grpc::CreateChannel(address, grpc::InsecureChannelCredentials());
    EXPECT_EQ(ListHosts(channel).error_code(), StatusCode::UNAVAILABLE);
  }
}

TEST_F(DoorsTest, ATokenMayDoWhatItsRoleSays) {
  const std::string viewer = Token("eve", v1::ROLE_VIEWER), administrator = Token("ada", v1::ROLE_ADMINISTRATOR);
  EXPECT_TRUE(ListHosts(Operators(viewer)).ok());
  const grpc::Status refused = AddHost(Operators(viewer), "alpha");
  EXPECT_EQ(refused.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(refused.error_message(), HasSubstr("token eve is a viewer's"));
  EXPECT_TRUE(AddHost(Operators(administrator), "alpha").ok());
  // It watches; it does not play.
  EXPECT_EQ(Join(Operators(viewer), true).error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(Join(Operators(viewer), false).error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(Join(Operators(Token("oscar", v1::ROLE_OPERATOR)), false).error_code(), StatusCode::NOT_FOUND);
}

// The outcome of a call by its name, with the request's `id` or `instance_id` set.
grpc::Status CallAbout(const std::shared_ptr<grpc::Channel>& channel, const google::protobuf::MethodDescriptor& method,
                       const std::string& instance) {
  const std::unique_ptr<google::protobuf::Message> request(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(method.input_type())->New());
  const google::protobuf::FieldDescriptor* field = method.input_type()->FindFieldByName("id");
  if (field == nullptr) field = method.input_type()->FindFieldByName("instance_id");
  request->GetReflection()->SetString(request.get(), field, instance);
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
  const auto call = stub.PrepareCall(&context, "/" + method.service()->full_name() + "/" + method.name(), &queue);
  const auto await = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  await();
  const grpc::Slice slice(request->SerializeAsString());
  call->WriteLast(grpc::ByteBuffer(&slice, 1), {}, nullptr);
  await();
  grpc::Status status;
  call->Finish(&status, nullptr);
  await();
  return status;
}

// Every method that names an instance, whatever methods there will be.
TEST_F(DoorsTest, ATokenForOneInstanceReachesNoOther) {
  const auto channel = Operators(Token("eve", v1::ROLE_OPERATOR, "inst-1"));
  int methods = 0;
  for (const google::protobuf::FileDescriptor* file :
       {v1::Instance::descriptor()->file(), v1::JoinInstanceRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service(0)->method_count(); ++i) {
      const google::protobuf::MethodDescriptor& method = *file->service(0)->method(i);
      const google::protobuf::Descriptor& request = *method.input_type();
      if (request.FindFieldByName("id") == nullptr && request.FindFieldByName("instance_id") == nullptr) continue;
      ++methods;
      for (const char* other : {"inst-2", "inst-12", ""}) {
        const grpc::Status refused = CallAbout(channel, method, other);
        EXPECT_EQ(refused.error_code(), StatusCode::PERMISSION_DENIED) << method.full_name() << " of " << other;
        EXPECT_THAT(refused.error_message(), HasSubstr("token eve is for the instances inst-1 alone"));
      }
      const grpc::Status own = CallAbout(channel, method, "inst-1");
      EXPECT_NE(own.error_code(), StatusCode::PERMISSION_DENIED) << method.full_name() << own.error_message();
      EXPECT_FALSE(own.ok()) << "there is no such instance";
    }
  }
  EXPECT_GE(methods, 19);
  EXPECT_EQ(ListHosts(channel).error_code(), StatusCode::PERMISSION_DENIED);
  v1::ListInstancesResponse listed;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::InstanceService::NewStub(channel)->ListInstances(&context, {}, &listed).ok());
  v1::GetSceneRequest scene;
  scene.set_scene_hash("feed");
  v1::GetSceneResponse got;
  grpc::ClientContext other;
  const grpc::Status none = v1::SessionService::NewStub(channel)->GetScene(&other, scene, &got);
  EXPECT_EQ(none.error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(none.error_message(), "scene_hash: no instance that token eve is for uses it");
  grpc::ClientContext streamed;
  const auto stream = v1::SessionService::NewStub(channel)->StreamScene(&streamed, scene);
  EXPECT_FALSE(stream->Read(&got));
  EXPECT_EQ(stream->Finish().error_message(), none.error_message());
}

TEST_F(DoorsTest, TheFirstAdministratorIsMadeAtTheSocketAlone) {
  const auto init = [](const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                       v1::InitClusterResponse& response) {
    v1::InitClusterRequest request;
    request.set_name(name);
    grpc::ClientContext context;
    return v1::AccessService::NewStub(channel)->InitCluster(&context, request, &response).error_code();
  };
  v1::InitClusterResponse made, none;
  ASSERT_EQ(init(Socket(), "admin", made), StatusCode::OK);
  EXPECT_EQ(made.fingerprint(), authority_.fingerprint);
  EXPECT_EQ(made.certificate(), authority_.signer.certificate);
  EXPECT_EQ(made.token().role(), v1::ROLE_ADMINISTRATOR);
  EXPECT_TRUE(AddHost(Operators(made.secret()), "alpha").ok());
  EXPECT_EQ(init(Operators(made.secret()), "second", none), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(init(Operators(), "second", none), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(init(Players(), "second", none), StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(none.secret().empty());
  EXPECT_EQ(init(Socket(), "admin", none), StatusCode::ALREADY_EXISTS);
}

// A proxy has one connection for many people.
TEST_F(DoorsTest, CallsOfOneConnectionAreJudgedEachByItsOwnToken) {
  const std::string viewer = Token("eve", v1::ROLE_VIEWER), administrator = Token("ada", v1::ROLE_ADMINISTRATOR);
  const auto channel = Operators();
  const auto add = [&](const std::string& token, const std::string& name) {
    v1::AddHostRequest request;
    request.set_name(name);
    v1::AddHostResponse response;
    grpc::ClientContext context;
    context.set_credentials(grpc::AccessTokenCredentials(token));
    return v1::HostService::NewStub(channel)->AddHost(&context, request, &response).error_code();
  };
  EXPECT_EQ(add(administrator, "alpha"), StatusCode::OK);
  EXPECT_EQ(add(viewer, "beta"), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(add(administrator, "gamma"), StatusCode::OK);
  EXPECT_EQ(ListHosts(channel).error_code(), StatusCode::UNAUTHENTICATED);
}

TEST_F(DoorsTest, ARevokedTokenIsRefusedFromTheNextCallOn) {
  const std::string token = Token("ada", v1::ROLE_ADMINISTRATOR);
  const auto channel = Operators(token);
  EXPECT_TRUE(ListHosts(channel).ok());
  v1::RevokeTokenRequest request;
  request.set_name("ada");
  v1::RevokeTokenResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(v1::AccessService::NewStub(channel)->RevokeToken(&context, request, &response).ok());
  EXPECT_EQ(ListHosts(channel).error_code(), StatusCode::UNAUTHENTICATED);
}

TEST_F(DoorsTest, PlayersJoinAndReachNothingElse) {
  EXPECT_EQ(Join(Players(), false).error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(ListHosts(Players()).error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(AddHost(Players(), "alpha").error_code(), StatusCode::PERMISSION_DENIED);
  v1::ListInstancesResponse listed;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::InstanceService::NewStub(Players())->ListInstances(&context, {}, &listed).ok());
}

TEST_F(DoorsTest, AHostThatJoinedShowsItsCertificate) {
  const Host host = JoinHost("alpha");
  ASSERT_EQ(host.id, "host-1");
  const auto own = Dialled(server_->operators(), host.credentials);
  v1::Admitted again;
  EXPECT_TRUE(Hello(own, HelloOf(host), &again).ok());
  EXPECT_EQ(again.host_name(), "alpha");
  EXPECT_EQ(FetchScene(own, host).error_code(), StatusCode::NOT_FOUND) << "let in; there is no such scene";
  EXPECT_EQ(ListHosts(own).error_code(), StatusCode::UNAUTHENTICATED) << "a host is no operator";
}

TEST_F(DoorsTest, AHostGetsItsNextCertificateAndTheEarlierOneEndsOnceThatIsShown) {
  const Host host = JoinHost("alpha");
  const auto own = Dialled(server_->operators(), host.credentials);
  v1::AgentHello hello = HelloOf(host);
  hello.set_certificate_request("no request");
  EXPECT_EQ(Hello(own, hello, nullptr).error_code(), StatusCode::INVALID_ARGUMENT);
  trust::Credentials next = host.credentials;
  next.key = *trust::MakeKey();
  hello.set_certificate_request(*trust::MakeRequest(next.key));
  EXPECT_EQ(Hello(Operators(), hello, nullptr).error_code(), StatusCode::UNAUTHENTICATED);
  v1::Admitted admitted;
  const grpc::Status status = Hello(own, hello, &admitted);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(admitted.host_secret(), "");
  next.certificate = admitted.certificate();
  const auto facts = trust::ReadCertificate(next.certificate);
  ASSERT_TRUE(facts.ok()) << facts.status();
  EXPECT_EQ(facts->common_name, "host-1");
  EXPECT_EQ(facts->serial, trust::ReadCertificate(host.credentials.certificate)->serial + "0001");
  EXPECT_TRUE(Hello(own, HelloOf(host), nullptr).ok()) << "the next one was not shown yet";

  const auto with_next = Dialled(server_->operators(), next);
  EXPECT_TRUE(Hello(with_next, HelloOf(host), nullptr).ok());
  EXPECT_EQ(FetchScene(with_next, host).error_code(), StatusCode::NOT_FOUND) << "let in; there is no such scene";
  EXPECT_EQ(Hello(own, HelloOf(host), nullptr).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(FetchScene(own, host).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Hello(own, hello, nullptr).error_code(), StatusCode::UNAUTHENTICATED) << "nor is it renewed any more";
}

TEST_F(DoorsTest, AHostsSecretAloneIsNotEnoughNorIsAnothersCertificate) {
  const Host alpha = JoinHost("alpha"), beta = JoinHost("beta");
  EXPECT_EQ(Hello(Operators(), HelloOf(alpha), nullptr).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(FetchScene(Operators(), alpha).error_code(), StatusCode::UNAUTHENTICATED);
  const auto as_beta = Dialled(server_->operators(), beta.credentials);
  EXPECT_EQ(Hello(as_beta, HelloOf(alpha), nullptr).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(FetchScene(as_beta, alpha).error_code(), StatusCode::UNAUTHENTICATED);
}

TEST_F(DoorsTest, ACertificateThatTheStoreDoesNotKnowIsWorthNothing) {
  const Host host = JoinHost("alpha");
  trust::Credentials forged = host.credentials;
  // The certificate is of the right authority, for the right host; but it was never given to it.
  forged.certificate =
      *trust::IssueClient(authority_.signer, *trust::MakeRequest(forged.key), "host-1", MakeSerial(SystemRandomBytes));
  EXPECT_EQ(Hello(Dialled(server_->operators(), forged), HelloOf(host), nullptr).error_code(),
            StatusCode::UNAUTHENTICATED);
  // And of another cluster's authority there is no connection.
  const auto other = *trust::MakeAuthority();
  forged.certificate = *trust::IssueClient(other, *trust::MakeRequest(forged.key), "host-1", "10");
  EXPECT_EQ(Hello(Dialled(server_->operators(), forged), HelloOf(host), nullptr).error_code(), StatusCode::UNAVAILABLE);
}

TEST_F(DoorsTest, ARemovedHostIsOutAtOnce) {
  const Host host = JoinHost("alpha");
  v1::RemoveHostRequest request;
  request.set_name("alpha");
  v1::RemoveHostResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(v1::HostService::NewStub(Socket())->RemoveHost(&context, request, &response).ok());
  const grpc::Status status = Hello(Dialled(server_->operators(), host.credentials), HelloOf(host), nullptr);
  EXPECT_EQ(status.error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_THAT(status.error_message(), HasSubstr("host-1 was removed"));
  v1::AgentHello renewal = HelloOf(host);
  renewal.set_certificate_request(*trust::MakeRequest(*trust::MakeKey()));
  const auto own = Dialled(server_->operators(), host.credentials);
  EXPECT_EQ(Hello(own, renewal, nullptr).error_code(), StatusCode::PERMISSION_DENIED);
}

TEST_F(DoorsTest, StreamsThatSayNothingAreFewAndDoNotKeepOthersOut) {
  const std::string token = Token("ada", v1::ROLE_ADMINISTRATOR);
  std::string join_token;
  ASSERT_TRUE(AddHost(Socket(), "alpha", &join_token).ok());
  const auto channel = Operators(join_token.substr(0, join_token.find('.')));
  const auto stub = v1::AgentLinkService::NewStub(channel);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::AgentMessage, v1::ControlMessage>>> streams;
  // 100 say nothing: the most that may wait do, and the others are refused.
  for (int i = 0; i < 100; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(stub->Attach(contexts.back().get()));
  }
  EXPECT_TRUE(ListHosts(Operators(token)).ok());
  int refused = 0;
  std::vector<std::thread> readers;
  std::mutex mutex;
  std::condition_variable changed;
  readers.reserve(streams.size());
  for (auto& stream : streams) {
    readers.emplace_back([&] {
      v1::ControlMessage answer;
      while (stream->Read(&answer)) {
      }
      const bool full = stream->Finish().error_code() == StatusCode::RESOURCE_EXHAUSTED;
      const std::lock_guard lock(mutex);
      refused += full ? 1 : 0;
      changed.notify_all();
    });
  }
  {
    std::unique_lock lock(mutex);
    EXPECT_TRUE(changed.wait_for(lock, std::chrono::seconds(30), [&] { return refused >= 100 - 64; }));
    EXPECT_EQ(refused, 100 - 64);
  }
  for (auto& context : contexts) context->TryCancel();
  for (std::thread& reader : readers) reader.join();
  EXPECT_TRUE(ListHosts(Operators(token)).ok());
}

TEST_F(DoorsTest, WhatListensNoMoreMakesRoomAndWhatIsNoSocketStays) {
  const std::string path = folder_.path() + "/other.sock";
  EXPECT_TRUE(PrepareSocket(path).ok());
  EXPECT_EQ(PrepareSocket(folder_.path() + "/control.sock").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(PrepareSocket(folder_.path() + "/seal.key").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(PrepareSocket("/" + std::string(200, 'x')).code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace tessera::control
