#include "client_sdk/recording.h"

#include <algorithm>
#include <array>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "client_sdk/file_path.h"
#include "client_sdk/recording_format.h"
#include "core/replication/codec/checksum.h"
#include "core/world/bytes.h"

namespace tessera::client {
namespace {

using replication::Bytes;

constexpr std::uint64_t kPreambleBytes = 8;
// An entry that ends a file: when, and how many there are before it.
constexpr std::uint64_t kEndBytes = kSealBytes + 1 + 10 + 10;
constexpr std::size_t kSummaryBytes = 2048;  // more than what is before the end of an instance's id

bool PutAll(std::ostream& out, std::span<const std::uint8_t> bytes) {
  return static_cast<bool>(
      out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())));
}

bool TakeAll(std::istream& in, std::span<std::uint8_t> bytes) {
  return static_cast<bool>(in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size())));
}

}  // namespace

absl::StatusOr<RecordingWriter> RecordingWriter::Create(const std::string& file, const RecordingHeader& header,
                                                        std::uint64_t max_bytes) {
  auto out = std::make_unique<std::ofstream>(FilePath(file), std::ios::binary | std::ios::trunc);
  if (!*out) return absl::UnavailableError(absl::StrCat(file, ": cannot be written"));
  RecordingWriter writer(std::move(out), file, max_bytes);
  if (absl::Status status = writer.Begin(header); !status.ok()) return status;
  return writer;
}

RecordingWriter::RecordingWriter(std::unique_ptr<std::ostream> out, std::string name, std::uint64_t max_bytes)
    : out_(std::move(out)), name_(std::move(name)), max_bytes_(max_bytes) {}

absl::Status RecordingWriter::Begin(const RecordingHeader& header) {
  ByteWriter preamble;
  preamble.U32(kRecordingMagic);
  preamble.U32(kRecordingFormat);
  bytes_ = preamble.size();
  if (!PutAll(*out_, preamble.bytes())) return absl::UnavailableError(absl::StrCat(name_, ": cannot be written"));
  return Put(EncodeHeader(header), kEndBytes);
}

absl::Status RecordingWriter::Put(std::span<const std::uint8_t> payload, std::uint64_t spare) {
  const std::size_t most = entries_ == 0 ? kMaxHeaderBytes : kMaxEntryBytes;
  if (payload.size() > most) return absl::ResourceExhaustedError(absl::StrCat(name_, ": an entry is too large"));
  if (bytes_ + kSealBytes + payload.size() + spare > max_bytes_) {
    return absl::ResourceExhaustedError(absl::StrCat(name_, ": full, at ", max_bytes_, " bytes"));
  }
  ByteWriter seal;
  seal.U32(static_cast<std::uint32_t>(payload.size()));
  seal.U32(replication::Crc32c(payload, entries_));
  if (!PutAll(*out_, seal.bytes()) || !PutAll(*out_, payload)) {
    return absl::UnavailableError(absl::StrCat(name_, ": cannot be written, at byte ", bytes_));
  }
  bytes_ += seal.size() + payload.size();
  ++entries_;
  return absl::OkStatus();
}

absl::Status RecordingWriter::Write(const RecordedEntry& entry) { return Put(EncodeEntry(entry), kEndBytes); }

absl::Status RecordingWriter::Close(std::chrono::microseconds at) {
  if (out_ == nullptr) return absl::OkStatus();
  ByteWriter end;
  end.U8(static_cast<std::uint8_t>(EntryKind::kEnd));
  end.Varint(static_cast<std::uint64_t>(at.count()));
  end.Varint(entries_);
  absl::Status status = Put(end.Take(), 0);
  if (status.ok() && !out_->flush()) status = absl::UnavailableError(absl::StrCat(name_, ": cannot be written"));
  out_.reset();
  return status;
}

// The last entry's payload has a few bytes, of a length that is not known: it is the one that its seal is right for.
absl::StatusOr<RecordingSummary> SummaryOf(const std::string& file) {
  std::ifstream in(FilePath(file), std::ios::binary);
  if (!in) return absl::NotFoundError(absl::StrCat(file, ": cannot be read"));
  std::vector<std::uint8_t> begin(kSummaryBytes);
  in.read(reinterpret_cast<char*>(begin.data()), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(in.gcount()));
  ByteReader words(begin);
  const std::uint32_t magic = words.U32(), format = words.U32();
  if (!words.ok() || magic != kRecordingMagic || !IsRead(format)) {
    return absl::InvalidArgumentError(absl::StrCat(file, ": is not a recording that this library reads"));
  }
  words.U32();  // length and checksum of an entry that is not read to its end
  words.U32();
  const bool header = words.U8() == static_cast<std::uint8_t>(EntryKind::kHeader);
  const std::span<const std::uint8_t> instance = words.Block(kSummaryBytes);
  if (!words.ok() || !header) return absl::DataLossError(absl::StrCat(file, ": damaged: header"));
  RecordingSummary summary{.instance_id = {instance.begin(), instance.end()}};

  in.clear();
  in.seekg(0, std::ios::end);
  const auto size = static_cast<std::uint64_t>(in.tellg());
  std::vector<std::uint8_t> end(std::min<std::uint64_t>(size, kEndBytes));
  in.seekg(static_cast<std::streamoff>(size - end.size()));
  if (!TakeAll(in, end)) return absl::DataLossError(absl::StrCat(file, ": cannot be read"));
  for (std::size_t at = 0; at + kSealBytes < end.size(); ++at) {
    const std::span<const std::uint8_t> payload = std::span(end).subspan(at + kSealBytes);
    const std::span<const std::uint8_t> sealed = std::span(end).subspan(at);
    ByteReader seal(sealed), entry(payload);
    const std::uint32_t length = seal.U32(), checksum = seal.U32();
    if (length != payload.size() || entry.U8() != static_cast<std::uint8_t>(EntryKind::kEnd)) continue;
    const std::uint64_t time_us = entry.Varint(), entries = entry.Varint();
    if (!entry.ok() || entry.remaining() > 0 || time_us > kMaxTime_us || entries > UINT32_MAX) continue;
    if (replication::Crc32c(payload, static_cast<std::uint32_t>(entries)) == checksum) {
      summary.length = std::chrono::microseconds(time_us);
    }
  }
  return summary;
}

absl::StatusOr<RecordingReader> RecordingReader::Open(const std::string& file) {
  auto in = std::make_unique<std::ifstream>(FilePath(file), std::ios::binary);
  if (!*in) return absl::NotFoundError(absl::StrCat(file, ": cannot be read"));
  return Open(std::move(in), file);
}

absl::StatusOr<RecordingReader> RecordingReader::Open(std::unique_ptr<std::istream> in, std::string name) {
  RecordingReader reader(std::move(in), std::move(name));
  if (absl::Status status = reader.Check(); !status.ok()) return status;
  return reader;
}

RecordingReader::RecordingReader(std::unique_ptr<std::istream> in, std::string name)
    : in_(std::move(in)), name_(std::move(name)) {
  in_->seekg(0, std::ios::end);
  const auto end = in_->tellg();
  size_ = end > 0 ? static_cast<std::uint64_t>(end) : 0;
  in_->seekg(0);
}

absl::Status RecordingReader::Damaged(absl::string_view what) const {
  return absl::DataLossError(absl::StrCat(name_, ": damaged at byte ", at_, ": ", what));
}

absl::StatusOr<std::vector<std::uint8_t>> RecordingReader::Take(std::uint64_t max_bytes) {
  std::array<std::uint8_t, kSealBytes> seal{};
  if (size_ - at_ < seal.size() || !TakeAll(*in_, seal)) return Damaged("the end is missing");
  ByteReader words(seal);
  const std::uint32_t length = words.U32(), checksum = words.U32();
  if (length > max_bytes || length == 0) return Damaged("length");
  if (length > size_ - at_ - seal.size()) return Damaged("the end is missing");
  std::vector<std::uint8_t> payload(length);
  if (!TakeAll(*in_, payload)) return Damaged("cannot be read");
  if (replication::Crc32c(payload, entries_) != checksum) return Damaged("checksum");
  at_ += seal.size() + length;
  ++entries_;
  return payload;
}

// Goes through all of it once, and back to where the header ends.
absl::Status RecordingReader::Check() {
  std::array<std::uint8_t, kPreambleBytes> preamble{};
  ByteReader words(preamble);
  if (size_ < preamble.size() || !TakeAll(*in_, preamble) || words.U32() != kRecordingMagic) {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": is not a recording"));
  }
  if (const std::uint32_t format = words.U32(); !IsRead(format)) {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": has format ", format, ", this library reads ",
                                                   kOldestRecordingFormat, " to ", kRecordingFormat));
  }
  at_ = preamble.size();
  auto payload = Take(kMaxHeaderBytes);
  if (!payload.ok()) return payload.status();
  absl::StatusOr<RecordingHeader> header = DecodeHeader(*payload);
  if (!header.ok()) return Damaged(header.status().message());
  header_ = *std::move(header);
  starts_ = {{.byte = at_, .entry = entries_}};
  Place key;  // the last one, as long as some of its frames have not come
  std::uint64_t frames_missing = 0;
  for (;;) {
    const Place here{.byte = at_, .entry = entries_};
    payload = Take(kMaxEntryBytes);
    if (!payload.ok()) return payload.status();
    ByteReader in(*payload);
    const auto kind = static_cast<EntryKind>(in.U8());
    const std::uint64_t at_us = in.Varint();
    if (!in.ok() || at_us > kMaxTime_us || std::chrono::microseconds(at_us) < length_) return Damaged("time");
    length_ = std::chrono::microseconds(at_us);
    if (kind == EntryKind::kKey) {
      key = {length_, here.byte, here.entry};
      frames_missing = in.Varint32();
      if (frames_missing == 0) starts_.push_back(key);
    } else if (frames_missing > 0) {
      if (kind != EntryKind::kKeyFrame) {
        frames_missing = 0;  // the file was full
      } else if (--frames_missing == 0) {
        starts_.push_back(key);
      }
    }
    if (kind != EntryKind::kEnd) continue;
    if (in.Varint() != entries_ - 1 || !in.ok() || in.remaining() > 0) return Damaged("the count of entries");
    break;
  }
  if (at_ != size_) return Damaged("goes on after its end");
  GoTo(starts_.front());
  return absl::OkStatus();
}

void RecordingReader::GoTo(const Place& place) {
  in_->seekg(static_cast<std::streamoff>(place.byte));
  at_ = place.byte;
  entries_ = place.entry;
}

void RecordingReader::Seek(std::chrono::microseconds at) {
  const auto after = std::upper_bound(starts_.begin() + 1, starts_.end(), at,
                                      [](std::chrono::microseconds t, const Place& place) { return t < place.time; });
  GoTo(*std::prev(after));
}

absl::StatusOr<std::optional<RecordedEntry>> RecordingReader::Next() {
  auto payload = Take(kMaxEntryBytes);
  if (!payload.ok()) return payload.status();
  if (payload->front() == static_cast<std::uint8_t>(EntryKind::kEnd)) {
    // Asked again, it is there again.
    at_ -= kSealBytes + payload->size();
    --entries_;
    in_->seekg(static_cast<std::streamoff>(at_));
    return std::optional<RecordedEntry>();
  }
  absl::StatusOr<RecordedEntry> entry = DecodeEntry(*payload);
  if (!entry.ok()) return Damaged(entry.status().message());
  return std::optional<RecordedEntry>(*std::move(entry));
}

}  // namespace tessera::client
