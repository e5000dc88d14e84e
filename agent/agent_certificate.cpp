// The agent's certificate: when the next one is asked for, and how it takes the place of the one before.
//
// The hello on a link that shows the certificate of now asks for the next one; the answer brings it, it is stored, and
// the agent dials anew with it. Until it has shown it, the one before counts, so whatever is lost on the way is asked
// for again.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "agent/agent.h"
#include "agent/certificate_age.h"
#include "agent/limits.h"
#include "telemetry/logging.h"
#include "trust/certificate.h"

namespace tessera::agent {
namespace {

Duration AfterSeconds(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

double UnixSeconds() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

bool Agent::CertificateIsDue() const {
  if (!identity_ || identity_->certificate().empty() || Clock::now() < next_renewal_) return false;
  return CertificateAge{identity_->certificate_time(), options_.certificate_life_s}.IsDue(UnixSeconds());
}

void Agent::AskWhereCertificateIsDue() {
  if (!requested_key_.empty() || !CertificateIsDue()) return;
  next_renewal_ = Clock::now() + AfterSeconds(options_.certificate_life_s * kRenewalRetry);
  auto key = trust::MakeKey();
  if (!key.ok()) {
    spdlog::error("certificate not renewed error={}", telemetry::LogValue(std::string(key.status().message())));
    return;
  }
  requested_key_ = *std::move(key);
}

void Agent::LookAfterCertificate() {
  const Duration pause = std::min<Duration>(kCertificateLook, AfterSeconds(options_.certificate_life_s * kLeastLook));
  loop_->RunAt(Clock::now() + pause, [this] { LookAfterCertificate(); });
  TellCertificate();
  if (!CertificateIsDue() || !session_->link()) return;
  OnAway();
  session_->Redial();
}

void Agent::NoteRenewal(const v1::Admitted& admitted, const absl::Status& kept) {
  requested_key_.clear();
  if (!kept.ok()) {
    spdlog::error("certificate not renewed: the new one cannot be kept error={}",
                  telemetry::LogValue(std::string(kept.message())));
  } else if (admitted.certificate().empty()) {
    spdlog::warn("certificate not renewed: the control plane gave none");
  } else {
    spdlog::info("certificate renewed host_id={} life_hours={:g}", telemetry::LogValue(admitted.host_id()),
                 options_.certificate_life_s / 3600);
  }
}

void Agent::TellCertificate() {
  if (!identity_ || identity_->certificate().empty()) return;
  const CertificateAge age{identity_->certificate_time(), options_.certificate_life_s};
  metrics_.SetCertificate(age.Left(UnixSeconds()), age.life_s);
}

}  // namespace tessera::agent
