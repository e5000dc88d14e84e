#include "gateway/http_connections.h"

#include <algorithm>

#include "gateway/web_request.h"

namespace tessera::gateway {
namespace {

// Bytes sent at once: libwebsockets keeps them for a socket that takes less.
constexpr std::size_t kPiece_bytes = 32 * 1024;
constexpr std::size_t kHead_bytes = 2048;
// A socket that takes nothing for so long is closed.
constexpr int kPieceTimeout_s = 10;

HttpRequest RequestOf(lws* wsi) {
  const auto has = [wsi](lws_token_indexes uri) { return lws_hdr_total_length(wsi, uri) > 0; };
  if (has(WSI_TOKEN_POST_URI)) {
    return {.method = HttpMethod::kPost,
            .path = HeaderOf(wsi, WSI_TOKEN_POST_URI),
            .authorization = HeaderOf(wsi, WSI_TOKEN_HTTP_AUTHORIZATION)};
  }
  const bool head = has(WSI_TOKEN_HEAD_URI);
  return {.method = head ? HttpMethod::kHead : HttpMethod::kGet,
          .path = HeaderOf(wsi, head ? WSI_TOKEN_HEAD_URI : WSI_TOKEN_GET_URI),
          .accept_encoding = HeaderOf(wsi, WSI_TOKEN_HTTP_ACCEPT_ENCODING),
          .if_none_match = HeaderOf(wsi, WSI_TOKEN_HTTP_IF_NONE_MATCH)};
}

}  // namespace

int HttpConnections::Begin(lws* wsi) {
  Connection& connection = connections_[wsi] = {};
  connection.exchange = site_.Ask(RequestOf(wsi), [wsi] { lws_callback_on_writable(wsi); });
  if (connection.exchange->answer) return SendHead(wsi, connection);
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, connection.exchange->patience_s);
  return 0;
}

int HttpConnections::Write(lws* wsi) {
  Connection& connection = connections_.at(wsi);
  if (!connection.exchange->answer) return 0;
  return connection.begun ? SendPiece(wsi, connection) : SendHead(wsi, connection);
}

int HttpConnections::SendHead(lws* wsi, Connection& connection) {
  const HttpAnswer& answer = *connection.exchange->answer;
  std::vector<unsigned char> head(LWS_PRE + kHead_bytes);
  unsigned char* at = head.data() + LWS_PRE;
  unsigned char* const begin = at;
  unsigned char* const end = head.data() + head.size() - 1;
  const auto add = [&](lws_token_indexes header, const std::string& value) {
    return value.empty() || AddHeader(wsi, header, value, &at, end);
  };
  if (lws_add_http_common_headers(wsi, answer.status, answer.type, answer.body->size(), &at, end) != 0 ||
      !add(WSI_TOKEN_HTTP_CACHE_CONTROL, answer.cache_control) || !add(WSI_TOKEN_HTTP_ETAG, answer.etag) ||
      !add(WSI_TOKEN_HTTP_VARY, answer.varies ? "Accept-Encoding" : "") ||
      !add(WSI_TOKEN_HTTP_CONTENT_ENCODING, answer.content_encoding == nullptr ? "" : answer.content_encoding) ||
      lws_finalize_write_http_header(wsi, begin, &at, end) != 0) {
    return 1;
  }
  connection.begun = true;
  if (!answer.with_body || answer.body->empty()) return Complete(wsi);
  // A short text goes with its head.
  if (answer.body->size() <= kPiece_bytes) return SendPiece(wsi, connection);
  lws_callback_on_writable(wsi);
  return 0;
}

int HttpConnections::SendPiece(lws* wsi, Connection& connection) {
  const std::string& body = *connection.exchange->answer->body;
  const std::size_t size = std::min(kPiece_bytes, body.size() - connection.sent);
  const auto from = body.begin() + static_cast<std::ptrdiff_t>(connection.sent);
  out_.resize(LWS_PRE + size);
  std::copy(from, from + static_cast<std::ptrdiff_t>(size), out_.begin() + LWS_PRE);
  connection.sent += size;
  const bool last = connection.sent == body.size();
  if (lws_write(wsi, out_.data() + LWS_PRE, size, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0) return -1;
  if (last) return Complete(wsi);
  lws_set_timeout(wsi, PENDING_TIMEOUT_HTTP_CONTENT, kPieceTimeout_s);
  lws_callback_on_writable(wsi);
  return 0;
}

int HttpConnections::Complete(lws* wsi) {
  connections_.erase(wsi);
  return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

}  // namespace tessera::gateway
