// Values and errors: handles on the JSON that lensd sent.
#include "lensd/value.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "access.h"
#include "lensd/error.h"
#include "tables.h"

namespace lensd {
inline namespace v1 {
namespace {

/// What only this library says.
constexpr std::array kOwnErrors = {
    ErrorRow{"", "Unavailable", "unavailable", 69}, ErrorRow{"", "SocketRefused", "not-permitted", 77},
    ErrorRow{"", "SocketFailed", "io", 74},         ErrorRow{"", "DeadlinePassed", "timeout", 5},
    ErrorRow{"", "BrokenReply", "protocol", 76},    ErrorRow{"", "BadText", "usage", 64},
    ErrorRow{"", "UnknownError", "protocol", 76},
};

const ErrorRow& RowOf(const std::string& name) {
  const auto same = [&](const ErrorRow& row) { return name == row.name; };
  if (const auto* found = std::find_if(std::begin(kErrorsOfLensd), std::end(kErrorsOfLensd), same);
      found != std::end(kErrorsOfLensd)) {
    return *found;
  }
  const auto found = std::find_if(kOwnErrors.begin(), kOwnErrors.end(), same);
  return found != kOwnErrors.end() ? *found : kOwnErrors.back();
}

std::string Dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

Value::Value() : at_(Access::Own(Json::object())) {}

std::string Value::json() const {
  return Dumped(Access::Of(*this));
}

const Json* Access::Null() {
  static const Json null;
  return &null;
}

void Access::Mismatch(const char* name, const Json& value) {
  throw LensdError("BrokenReply", value.is_null() ? "lensd left out " + std::string(name)
                                                  : std::string(name) + " is " + Dumped(value).substr(0, 80) +
                                                        ", which the interface does not allow");
}

struct LensdError::Impl {
  std::string name, code, fields;
  int status = 0;
  Json parsed;
};

LensdError::LensdError(const std::string& name, const std::string& message, const std::string& fields)
    : std::runtime_error(message) {
  const ErrorRow& row = RowOf(name);
  impl_ = std::make_shared<const Impl>(Impl{name, row.code, fields, row.status, Json::parse(fields, nullptr, false)});
}

LensdError::LensdError(const LensdError&) = default;
LensdError& LensdError::operator=(const LensdError&) = default;
LensdError::~LensdError() = default;

const std::string& LensdError::name() const {
  return impl_->name;
}

bool LensdError::Is(const char* name) const {
  const std::string wanted = name;
  return impl_->name == wanted || (impl_->name == "DeadlinePassed" && wanted == "Timeout") ||
         (impl_->name == "SocketRefused" && wanted == "NotPermitted");
}

int LensdError::exit_status() const {
  return impl_->status;
}

const std::string& LensdError::code() const {
  return impl_->code;
}

namespace {

std::string TextOf(const Json& fields, const char* name) {
  const auto found = fields.is_object() ? fields.find(name) : fields.end();
  return found != fields.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::optional<double> NumberOf(const Json& fields, const char* name) {
  const auto found = fields.is_object() ? fields.find(name) : fields.end();
  return found != fields.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

}  // namespace

std::string LensdError::lens() const {
  return TextOf(impl_->parsed, "lens");
}
std::string LensdError::axis() const {
  return TextOf(impl_->parsed, "axis");
}
std::string LensdError::parameter() const {
  return TextOf(impl_->parsed, "parameter");
}
std::optional<double> LensdError::minimum() const {
  return NumberOf(impl_->parsed, "minimum");
}
std::optional<double> LensdError::maximum() const {
  return NumberOf(impl_->parsed, "maximum");
}
std::string LensdError::unit() const {
  return TextOf(impl_->parsed, "unit");
}
const std::string& LensdError::fields() const {
  return impl_->fields;
}

}  // namespace v1
}  // namespace lensd
