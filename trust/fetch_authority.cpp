#include "trust/fetch_authority.h"

#include <openssl/pem.h>
#include <poll.h>

#include "absl/strings/str_cat.h"
#include "trust/certificate.h"
#include "trust/openssl_handles.h"

namespace tessera::trust {
namespace {

using Clock = std::chrono::steady_clock;

// Waits until `bio`, which did not block, can go on. False: the time is over.
bool WaitToGoOn(BIO* bio, Clock::time_point until) {
  int socket = -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
  if (left.count() <= 0 || !BIO_should_retry(bio)) return false;
  if (BIO_get_fd(bio, &socket) < 0 || socket < 0) return false;
  const short events = BIO_should_read(bio) ? POLLIN : POLLOUT;
  pollfd waited{.fd = socket, .events = events, .revents = 0};
  return poll(&waited, 1, static_cast<int>(left.count())) > 0;
}

absl::StatusOr<std::string> FindIn(SSL* tls, const std::string& fingerprint, const std::string& where) {
  const STACK_OF(X509)* chain = SSL_get_peer_cert_chain(tls);
  for (int i = 0; i < sk_X509_num(chain); ++i) {
    const BioHandle bio(BIO_new(BIO_s_mem()));
    if (!bio || PEM_write_bio_X509(bio.get(), sk_X509_value(chain, i)) != 1) continue;
    std::string text = TextOf(bio.get());
    const auto facts = ReadCertificate(text);
    if (facts.ok() && facts->fingerprint == fingerprint) return text;
  }
  return absl::UnauthenticatedError(absl::StrCat("what answers at ", where,
                                                 " is not the cluster whose authority was named, with fingerprint ",
                                                 fingerprint.substr(0, 16), "…"));
}

}  // namespace

absl::StatusOr<std::string> FetchAuthority(const host::SocketAddress& address, const std::string& fingerprint,
                                           std::chrono::milliseconds timeout) {
  const Clock::time_point until = Clock::now() + timeout;
  const std::string where = ToString(address);
  const TlsContextHandle context(SSL_CTX_new(TLS_client_method()));
  if (!context) return OpensslFault("TLS");
  SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
  // The chain is not checked here but by its fingerprint, and by gRPC for each connection that follows.
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_NONE, nullptr);
  const BioHandle connection(BIO_new_ssl_connect(context.get()));
  SSL* tls = nullptr;
  if (!connection || BIO_get_ssl(connection.get(), &tls) != 1 || tls == nullptr) return OpensslFault("TLS");
  SSL_set_tlsext_host_name(tls, kControlName);
  // gRPC's servers end a handshake that does not speak HTTP/2.
  static constexpr unsigned char kHttp2[] = {2, 'h', '2'};
  SSL_set_alpn_protos(tls, kHttp2, sizeof kHttp2);
  BIO_set_conn_hostname(connection.get(), where.c_str());
  BIO_set_nbio(connection.get(), 1);
  while (BIO_do_connect(connection.get()) <= 0) {
    if (!WaitToGoOn(connection.get(), until)) {
      return absl::UnavailableError(absl::StrCat("no control plane answers by TLS at ", where));
    }
  }
  return FindIn(tls, fingerprint, where);
}

}  // namespace tessera::trust
