// What the classes of lensd/types.h do.
// Written by script/client-types from proto/io.lensd.Lens.varlink: change that, not this.
#include "lensd/types.h"

#include "access.h"

namespace lensd {
inline namespace v1 {

std::int64_t DaemonMetrics::sinceNs() const {
  return Access::Get<std::int64_t>(*this, "sinceNs");
}
std::int64_t DaemonMetrics::filesWaiting() const {
  return Access::Get<std::int64_t>(*this, "filesWaiting");
}
std::int64_t DaemonMetrics::plansWaiting() const {
  return Access::Get<std::int64_t>(*this, "plansWaiting");
}
std::int64_t DaemonMetrics::failuresTold() const {
  return Access::Get<std::int64_t>(*this, "failuresTold");
}
std::int64_t DaemonMetrics::failuresNotTold() const {
  return Access::Get<std::int64_t>(*this, "failuresNotTold");
}
std::int64_t DaemonMetrics::failuresDropped() const {
  return Access::Get<std::int64_t>(*this, "failuresDropped");
}
std::string AxisInfo::axis() const {
  return Access::Get<std::string>(*this, "axis");
}
std::string AxisInfo::unit() const {
  return Access::Get<std::string>(*this, "unit");
}
double AxisInfo::minimum() const {
  return Access::Get<double>(*this, "minimum");
}
double AxisInfo::maximum() const {
  return Access::Get<double>(*this, "maximum");
}
double AxisInfo::resolution() const {
  return Access::Get<double>(*this, "resolution");
}
std::string AxisInfo::feedback() const {
  return Access::Get<std::string>(*this, "feedback");
}
bool AxisInfo::canHome() const {
  return Access::Get<bool>(*this, "canHome");
}
bool AxisInfo::needsHome() const {
  return Access::Get<bool>(*this, "needsHome");
}
bool AxisInfo::canStop() const {
  return Access::Get<bool>(*this, "canStop");
}
std::optional<std::string> AxisInfo::direction() const {
  return Access::Get<std::optional<std::string>>(*this, "direction");
}
std::optional<std::string> AxisInfo::directionFrom() const {
  return Access::Get<std::optional<std::string>>(*this, "directionFrom");
}
std::optional<std::string> AxisInfo::directionBy() const {
  return Access::Get<std::optional<std::string>>(*this, "directionBy");
}
std::optional<bool> AxisInfo::referenced() const {
  return Access::Get<std::optional<bool>>(*this, "referenced");
}
double OpticsInfo::focalLengthMm() const {
  return Access::Get<double>(*this, "focalLengthMm");
}
double OpticsInfo::fNumberMin() const {
  return Access::Get<double>(*this, "fNumberMin");
}
double OpticsInfo::fNumberMax() const {
  return Access::Get<double>(*this, "fNumberMax");
}
double OpticsInfo::extensionMinMm() const {
  return Access::Get<double>(*this, "extensionMinMm");
}
double OpticsInfo::extensionMaxMm() const {
  return Access::Get<double>(*this, "extensionMaxMm");
}
double OpticsInfo::principalGapMm() const {
  return Access::Get<double>(*this, "principalGapMm");
}
double OpticsInfo::pupilFactor() const {
  return Access::Get<double>(*this, "pupilFactor");
}
std::string OpticsInfo::distanceFrom() const {
  return Access::Get<std::string>(*this, "distanceFrom");
}
double OpticsInfo::sensorToleranceUm() const {
  return Access::Get<double>(*this, "sensorToleranceUm");
}
double OpticsInfo::fNumberTolerance() const {
  return Access::Get<double>(*this, "fNumberTolerance");
}
std::optional<double> OpticsInfo::focalLengthMaxMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMaxMm");
}
std::optional<double> OpticsInfo::focalLengthTolerance() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthTolerance");
}
std::string OpticsInfo::grade() const {
  return Access::Get<std::string>(*this, "grade");
}
std::optional<double> OpticsInfo::calibrationErrorUm() const {
  return Access::Get<std::optional<double>>(*this, "calibrationErrorUm");
}
std::optional<std::string> OpticsInfo::calibrationFile() const {
  return Access::Get<std::optional<std::string>>(*this, "calibrationFile");
}
std::string CameraInfo::driver() const {
  return Access::Get<std::string>(*this, "driver");
}
std::string CameraInfo::model() const {
  return Access::Get<std::string>(*this, "model");
}
std::optional<std::string> CameraInfo::serial() const {
  return Access::Get<std::optional<std::string>>(*this, "serial");
}
std::int64_t CameraInfo::widthPx() const {
  return Access::Get<std::int64_t>(*this, "widthPx");
}
std::int64_t CameraInfo::heightPx() const {
  return Access::Get<std::int64_t>(*this, "heightPx");
}
std::int64_t CameraInfo::bits() const {
  return Access::Get<std::int64_t>(*this, "bits");
}
std::optional<double> CameraInfo::pixelUm() const {
  return Access::Get<std::optional<double>>(*this, "pixelUm");
}
std::optional<double> CameraInfo::frameRateHz() const {
  return Access::Get<std::optional<double>>(*this, "frameRateHz");
}
bool CameraInfo::colour() const {
  return Access::Get<bool>(*this, "colour");
}
std::string LeftOut::part() const {
  return Access::Get<std::string>(*this, "part");
}
std::string LeftOut::reason() const {
  return Access::Get<std::string>(*this, "reason");
}
std::string LensInfo::name() const {
  return Access::Get<std::string>(*this, "name");
}
std::string LensInfo::driver() const {
  return Access::Get<std::string>(*this, "driver");
}
std::optional<std::string> LensInfo::model() const {
  return Access::Get<std::optional<std::string>>(*this, "model");
}
std::optional<std::string> LensInfo::serial() const {
  return Access::Get<std::optional<std::string>>(*this, "serial");
}
std::vector<AxisInfo> LensInfo::axes() const {
  return Access::Get<std::vector<AxisInfo>>(*this, "axes");
}
std::optional<OpticsInfo> LensInfo::optics() const {
  return Access::Get<std::optional<OpticsInfo>>(*this, "optics");
}
std::optional<CameraInfo> LensInfo::camera() const {
  return Access::Get<std::optional<CameraInfo>>(*this, "camera");
}
std::vector<LeftOut> LensInfo::leftOut() const {
  return Access::Get<std::vector<LeftOut>>(*this, "leftOut");
}
std::string AxisStatus::axis() const {
  return Access::Get<std::string>(*this, "axis");
}
double AxisStatus::position() const {
  return Access::Get<double>(*this, "position");
}
double AxisStatus::target() const {
  return Access::Get<double>(*this, "target");
}
bool AxisStatus::moving() const {
  return Access::Get<bool>(*this, "moving");
}
bool AxisStatus::homed() const {
  return Access::Get<bool>(*this, "homed");
}
std::optional<bool> AxisStatus::lastKnown() const {
  return Access::Get<std::optional<bool>>(*this, "lastKnown");
}
std::optional<double> AxisStatus::positionBound() const {
  return Access::Get<std::optional<double>>(*this, "positionBound");
}
std::optional<std::string> AxisStatus::movedBy() const {
  return Access::Get<std::optional<std::string>>(*this, "movedBy");
}
std::optional<std::string> AxisStatus::fault() const {
  return Access::Get<std::optional<std::string>>(*this, "fault");
}
std::optional<bool> AxisStatus::positionUnknown() const {
  return Access::Get<std::optional<bool>>(*this, "positionUnknown");
}
std::int64_t Counters::framesLost() const {
  return Access::Get<std::int64_t>(*this, "framesLost");
}
std::int64_t Counters::framesLate() const {
  return Access::Get<std::int64_t>(*this, "framesLate");
}
std::int64_t Counters::packetsLost() const {
  return Access::Get<std::int64_t>(*this, "packetsLost");
}
std::int64_t Counters::packetsResent() const {
  return Access::Get<std::int64_t>(*this, "packetsResent");
}
std::int64_t Counters::busErrors() const {
  return Access::Get<std::int64_t>(*this, "busErrors");
}
std::optional<std::int64_t> Counters::temperaturesLeftOut() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "temperaturesLeftOut");
}
std::optional<std::int64_t> Counters::framesDamaged() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "framesDamaged");
}
std::vector<double> Histogram::upToMs() const {
  return Access::Get<std::vector<double>>(*this, "upToMs");
}
std::vector<std::int64_t> Histogram::counts() const {
  return Access::Get<std::vector<std::int64_t>>(*this, "counts");
}
std::int64_t Histogram::count() const {
  return Access::Get<std::int64_t>(*this, "count");
}
double Histogram::sumMs() const {
  return Access::Get<double>(*this, "sumMs");
}
std::string LensMetrics::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::int64_t LensMetrics::moves() const {
  return Access::Get<std::int64_t>(*this, "moves");
}
std::int64_t LensMetrics::movesReached() const {
  return Access::Get<std::int64_t>(*this, "movesReached");
}
std::int64_t LensMetrics::movesVerified() const {
  return Access::Get<std::int64_t>(*this, "movesVerified");
}
std::optional<std::int64_t> LensMetrics::movesMissed() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "movesMissed");
}
std::int64_t LensMetrics::autofocuses() const {
  return Access::Get<std::int64_t>(*this, "autofocuses");
}
std::int64_t LensMetrics::autofocusesFocused() const {
  return Access::Get<std::int64_t>(*this, "autofocusesFocused");
}
std::int64_t LensMetrics::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
std::optional<std::int64_t> LensMetrics::framesFlawed() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "framesFlawed");
}
std::optional<std::int64_t> LensMetrics::refused() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "refused");
}
std::optional<std::int64_t> LensMetrics::openings() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "openings");
}
std::optional<std::int64_t> LensMetrics::failures() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "failures");
}
std::optional<std::int64_t> LensMetrics::commandsWaiting() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "commandsWaiting");
}
std::optional<Histogram> LensMetrics::waitMs() const {
  return Access::Get<std::optional<Histogram>>(*this, "waitMs");
}
std::optional<Histogram> LensMetrics::settleMs() const {
  return Access::Get<std::optional<Histogram>>(*this, "settleMs");
}
Counters LensMetrics::counters() const {
  return Access::Get<Counters>(*this, "counters");
}
std::string Unwritten::file() const {
  return Access::Get<std::string>(*this, "file");
}
std::int64_t Unwritten::sinceNs() const {
  return Access::Get<std::int64_t>(*this, "sinceNs");
}
std::string Unwritten::reason() const {
  return Access::Get<std::string>(*this, "reason");
}
std::string LensStatus::name() const {
  return Access::Get<std::string>(*this, "name");
}
bool LensStatus::connected() const {
  return Access::Get<bool>(*this, "connected");
}
std::string LensStatus::connection() const {
  return Access::Get<std::string>(*this, "connection");
}
std::optional<bool> LensStatus::latched() const {
  return Access::Get<std::optional<bool>>(*this, "latched");
}
std::optional<std::int64_t> LensStatus::holdUntilNs() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "holdUntilNs");
}
std::vector<std::string> LensStatus::warnings() const {
  return Access::Get<std::optional<std::vector<std::string>>>(*this, "warnings").value_or(std::vector<std::string>());
}
std::vector<Unwritten> LensStatus::unwritten() const {
  return Access::Get<std::optional<std::vector<Unwritten>>>(*this, "unwritten").value_or(std::vector<Unwritten>());
}
std::optional<std::string> LensStatus::error() const {
  return Access::Get<std::optional<std::string>>(*this, "error");
}
std::string LensStatus::activity() const {
  return Access::Get<std::string>(*this, "activity");
}
std::int64_t LensStatus::step() const {
  return Access::Get<std::int64_t>(*this, "step");
}
std::int64_t LensStatus::stepsExpected() const {
  return Access::Get<std::int64_t>(*this, "stepsExpected");
}
std::vector<AxisStatus> LensStatus::axes() const {
  return Access::Get<std::vector<AxisStatus>>(*this, "axes");
}
std::vector<LeftOut> LensStatus::leftOut() const {
  return Access::Get<std::vector<LeftOut>>(*this, "leftOut");
}
std::optional<double> LensStatus::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> LensStatus::focalPlaneM() const {
  return Access::Get<std::optional<double>>(*this, "focalPlaneM");
}
std::optional<double> LensStatus::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
std::optional<double> LensStatus::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::optional<double> LensStatus::focalLengthMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMm");
}
std::optional<double> LensStatus::centreShiftMm() const {
  return Access::Get<std::optional<double>>(*this, "centreShiftMm");
}
std::optional<std::string> LensStatus::grade() const {
  return Access::Get<std::optional<std::string>>(*this, "grade");
}
std::optional<double> LensStatus::calibrationErrorUm() const {
  return Access::Get<std::optional<double>>(*this, "calibrationErrorUm");
}
std::optional<double> LensStatus::temperatureC() const {
  return Access::Get<std::optional<double>>(*this, "temperatureC");
}
std::optional<std::string> LensStatus::temperatureFault() const {
  return Access::Get<std::optional<std::string>>(*this, "temperatureFault");
}
std::optional<Counters> LensStatus::counters() const {
  return Access::Get<std::optional<Counters>>(*this, "counters");
}
std::optional<LeaseInfo> LensStatus::lease() const {
  return Access::Get<std::optional<LeaseInfo>>(*this, "lease");
}
std::int64_t LensStatus::readAtNs() const {
  return Access::Get<std::int64_t>(*this, "readAtNs");
}
std::optional<double> LensStatus::vergenceBoundD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceBoundD");
}
std::optional<double> LensStatus::fNumberBound() const {
  return Access::Get<std::optional<double>>(*this, "fNumberBound");
}
std::optional<double> Target::distanceM() const {
  return Access::Get<std::optional<double>>(*this, "distanceM");
}
Target& Target::distanceM(double value) {
  Access::Set(*this, "distanceM", value);
  return *this;
}
std::optional<double> Target::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
Target& Target::vergenceD(double value) {
  Access::Set(*this, "vergenceD", value);
  return *this;
}
std::optional<double> Target::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
Target& Target::extensionMm(double value) {
  Access::Set(*this, "extensionMm", value);
  return *this;
}
std::optional<double> Target::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
Target& Target::fNumber(double value) {
  Access::Set(*this, "fNumber", value);
  return *this;
}
std::optional<double> Target::focalLengthMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMm");
}
Target& Target::focalLengthMm(double value) {
  Access::Set(*this, "focalLengthMm", value);
  return *this;
}
std::optional<double> Target::position() const {
  return Access::Get<std::optional<double>>(*this, "position");
}
Target& Target::position(double value) {
  Access::Set(*this, "position", value);
  return *this;
}
std::optional<double> Target::relative() const {
  return Access::Get<std::optional<double>>(*this, "relative");
}
Target& Target::relative(double value) {
  Access::Set(*this, "relative", value);
  return *this;
}
std::optional<double> Target::nearer() const {
  return Access::Get<std::optional<double>>(*this, "nearer");
}
Target& Target::nearer(double value) {
  Access::Set(*this, "nearer", value);
  return *this;
}
std::string MoveResult::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::string MoveResult::axis() const {
  return Access::Get<std::string>(*this, "axis");
}
bool MoveResult::reached() const {
  return Access::Get<bool>(*this, "reached");
}
bool MoveResult::settled() const {
  return Access::Get<bool>(*this, "settled");
}
bool MoveResult::verified() const {
  return Access::Get<bool>(*this, "verified");
}
double MoveResult::position() const {
  return Access::Get<double>(*this, "position");
}
std::optional<bool> MoveResult::kept() const {
  return Access::Get<std::optional<bool>>(*this, "kept");
}
std::optional<double> MoveResult::positionBound() const {
  return Access::Get<std::optional<double>>(*this, "positionBound");
}
std::optional<double> MoveResult::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> MoveResult::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::optional<double> MoveResult::focalLengthMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMm");
}
std::optional<double> MoveResult::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
std::optional<double> MoveResult::extensionBoundUm() const {
  return Access::Get<std::optional<double>>(*this, "extensionBoundUm");
}
std::optional<bool> MoveResult::missed() const {
  return Access::Get<std::optional<bool>>(*this, "missed");
}
std::string MoveResult::movedBy() const {
  return Access::Get<std::string>(*this, "movedBy");
}
std::optional<double> MoveResult::vergenceBoundD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceBoundD");
}
std::optional<double> MoveResult::focalLengthBoundMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthBoundMm");
}
std::optional<double> MoveResult::trackingBoundUm() const {
  return Access::Get<std::optional<double>>(*this, "trackingBoundUm");
}
std::optional<double> MoveResult::keptD() const {
  return Access::Get<std::optional<double>>(*this, "keptD");
}
std::optional<double> MoveResult::exposureMs() const {
  return Access::Get<std::optional<double>>(*this, "exposureMs");
}
std::optional<double> MoveResult::brightnessRatio() const {
  return Access::Get<std::optional<double>>(*this, "brightnessRatio");
}
std::optional<std::string> MoveResult::cause() const {
  return Access::Get<std::optional<std::string>>(*this, "cause");
}
std::optional<std::string> MoveResult::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
double MoveResult::elapsedMs() const {
  return Access::Get<double>(*this, "elapsedMs");
}
std::string MoveProgress::axis() const {
  return Access::Get<std::string>(*this, "axis");
}
double MoveProgress::position() const {
  return Access::Get<double>(*this, "position");
}
double MoveProgress::target() const {
  return Access::Get<double>(*this, "target");
}
double Region::x() const {
  return Access::Get<double>(*this, "x");
}
Region& Region::x(double value) {
  Access::Set(*this, "x", value);
  return *this;
}
double Region::y() const {
  return Access::Get<double>(*this, "y");
}
Region& Region::y(double value) {
  Access::Set(*this, "y", value);
  return *this;
}
double Region::w() const {
  return Access::Get<double>(*this, "w");
}
Region& Region::w(double value) {
  Access::Set(*this, "w", value);
  return *this;
}
double Region::h() const {
  return Access::Get<double>(*this, "h");
}
Region& Region::h(double value) {
  Access::Set(*this, "h", value);
  return *this;
}
Target FocusRange::from() const {
  return Access::Get<Target>(*this, "from");
}
FocusRange& FocusRange::from(const Target& value) {
  Access::Set(*this, "from", value);
  return *this;
}
Target FocusRange::to() const {
  return Access::Get<Target>(*this, "to");
}
FocusRange& FocusRange::to(const Target& value) {
  Access::Set(*this, "to", value);
  return *this;
}
std::optional<double> FocusStep::relative() const {
  return Access::Get<std::optional<double>>(*this, "relative");
}
FocusStep& FocusStep::relative(double value) {
  Access::Set(*this, "relative", value);
  return *this;
}
std::optional<double> FocusStep::extensionUm() const {
  return Access::Get<std::optional<double>>(*this, "extensionUm");
}
FocusStep& FocusStep::extensionUm(double value) {
  Access::Set(*this, "extensionUm", value);
  return *this;
}
std::optional<double> FocusStep::blurPx() const {
  return Access::Get<std::optional<double>>(*this, "blurPx");
}
FocusStep& FocusStep::blurPx(double value) {
  Access::Set(*this, "blurPx", value);
  return *this;
}
std::int64_t AutofocusSample::frame() const {
  return Access::Get<std::int64_t>(*this, "frame");
}
std::int64_t AutofocusSample::region() const {
  return Access::Get<std::int64_t>(*this, "region");
}
std::string AutofocusSample::state() const {
  return Access::Get<std::string>(*this, "state");
}
double AutofocusSample::position() const {
  return Access::Get<double>(*this, "position");
}
std::optional<double> AutofocusSample::positionBound() const {
  return Access::Get<std::optional<double>>(*this, "positionBound");
}
std::optional<double> AutofocusSample::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
double AutofocusSample::score() const {
  return Access::Get<double>(*this, "score");
}
double AutofocusSample::scoreSigma() const {
  return Access::Get<double>(*this, "scoreSigma");
}
std::int64_t AutofocusSample::exposureStartNs() const {
  return Access::Get<std::int64_t>(*this, "exposureStartNs");
}
std::int64_t AutofocusSample::exposureEndNs() const {
  return Access::Get<std::int64_t>(*this, "exposureEndNs");
}
std::int64_t AutofocusStars::count() const {
  return Access::Get<std::int64_t>(*this, "count");
}
std::int64_t AutofocusStars::clipped() const {
  return Access::Get<std::int64_t>(*this, "clipped");
}
std::optional<double> AutofocusStars::hfrPx() const {
  return Access::Get<std::optional<double>>(*this, "hfrPx");
}
std::optional<double> AutofocusStars::fwhmPx() const {
  return Access::Get<std::optional<double>>(*this, "fwhmPx");
}
std::int64_t AutofocusSubject::region() const {
  return Access::Get<std::int64_t>(*this, "region");
}
std::string AutofocusSubject::foundBy() const {
  return Access::Get<std::string>(*this, "foundBy");
}
double AutofocusSubject::position() const {
  return Access::Get<double>(*this, "position");
}
std::optional<double> AutofocusSubject::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> AutofocusSubject::focalPlaneM() const {
  return Access::Get<std::optional<double>>(*this, "focalPlaneM");
}
std::optional<double> AutofocusSubject::sigmaD() const {
  return Access::Get<std::optional<double>>(*this, "sigmaD");
}
std::int64_t AutofocusProgress::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
std::int64_t AutofocusProgress::moves() const {
  return Access::Get<std::int64_t>(*this, "moves");
}
std::int64_t AutofocusProgress::framesExpected() const {
  return Access::Get<std::int64_t>(*this, "framesExpected");
}
double AutofocusProgress::position() const {
  return Access::Get<double>(*this, "position");
}
std::optional<double> AutofocusProgress::sharpness() const {
  return Access::Get<std::optional<double>>(*this, "sharpness");
}
std::vector<AutofocusSample> AutofocusProgress::samples() const {
  return Access::Get<std::vector<AutofocusSample>>(*this, "samples");
}
std::int64_t AutofocusCandidate::region() const {
  return Access::Get<std::int64_t>(*this, "region");
}
double AutofocusCandidate::position() const {
  return Access::Get<double>(*this, "position");
}
std::optional<double> AutofocusCandidate::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> SearchConditions::exposureMs() const {
  return Access::Get<std::optional<double>>(*this, "exposureMs");
}
SearchConditions& SearchConditions::exposureMs(double value) {
  Access::Set(*this, "exposureMs", value);
  return *this;
}
std::optional<double> SearchConditions::gain() const {
  return Access::Get<std::optional<double>>(*this, "gain");
}
SearchConditions& SearchConditions::gain(double value) {
  Access::Set(*this, "gain", value);
  return *this;
}
std::optional<double> SearchConditions::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
SearchConditions& SearchConditions::fNumber(double value) {
  Access::Set(*this, "fNumber", value);
  return *this;
}
std::optional<double> SearchConditions::filterPosition() const {
  return Access::Get<std::optional<double>>(*this, "filterPosition");
}
SearchConditions& SearchConditions::filterPosition(double value) {
  Access::Set(*this, "filterPosition", value);
  return *this;
}
std::optional<double> ShiftSize::extensionUm() const {
  return Access::Get<std::optional<double>>(*this, "extensionUm");
}
std::optional<double> ShiftSize::sigmaUm() const {
  return Access::Get<std::optional<double>>(*this, "sigmaUm");
}
std::optional<double> ShiftSize::size() const {
  return Access::Get<std::optional<double>>(*this, "size");
}
std::optional<double> ShiftSize::sizeSigma() const {
  return Access::Get<std::optional<double>>(*this, "sizeSigma");
}
std::optional<double> FocusShift::fromFNumber() const {
  return Access::Get<std::optional<double>>(*this, "fromFNumber");
}
std::optional<double> FocusShift::toFNumber() const {
  return Access::Get<std::optional<double>>(*this, "toFNumber");
}
std::optional<double> FocusShift::fromFilter() const {
  return Access::Get<std::optional<double>>(*this, "fromFilter");
}
std::optional<double> FocusShift::toFilter() const {
  return Access::Get<std::optional<double>>(*this, "toFilter");
}
std::optional<double> FocusShift::focalLengthMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMm");
}
ShiftSize FocusShift::shift() const {
  return Access::Get<ShiftSize>(*this, "shift");
}
std::int64_t FocusShift::pairs() const {
  return Access::Get<std::int64_t>(*this, "pairs");
}
std::optional<std::string> FocusShift::made() const {
  return Access::Get<std::optional<std::string>>(*this, "made");
}
std::optional<double> SearchedUnder::exposureMs() const {
  return Access::Get<std::optional<double>>(*this, "exposureMs");
}
std::optional<double> SearchedUnder::gain() const {
  return Access::Get<std::optional<double>>(*this, "gain");
}
std::optional<double> SearchedUnder::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::optional<double> SearchedUnder::filterPosition() const {
  return Access::Get<std::optional<double>>(*this, "filterPosition");
}
bool SearchedUnder::restored() const {
  return Access::Get<bool>(*this, "restored");
}
std::optional<std::string> SearchedUnder::stays() const {
  return Access::Get<std::optional<std::string>>(*this, "stays");
}
std::optional<ShiftSize> SearchedUnder::shift() const {
  return Access::Get<std::optional<ShiftSize>>(*this, "shift");
}
std::optional<std::string> SearchedUnder::shiftReason() const {
  return Access::Get<std::optional<std::string>>(*this, "shiftReason");
}
std::int64_t FocusShiftProgress::search() const {
  return Access::Get<std::int64_t>(*this, "search");
}
std::int64_t FocusShiftProgress::searchesExpected() const {
  return Access::Get<std::int64_t>(*this, "searchesExpected");
}
std::int64_t FocusShiftProgress::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
std::string FocusShiftResult::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
bool FocusShiftResult::measured() const {
  return Access::Get<bool>(*this, "measured");
}
std::optional<FocusShift> FocusShiftResult::shift() const {
  return Access::Get<std::optional<FocusShift>>(*this, "shift");
}
std::int64_t FocusShiftResult::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
double FocusShiftResult::elapsedMs() const {
  return Access::Get<double>(*this, "elapsedMs");
}
std::optional<std::string> FocusShiftResult::cause() const {
  return Access::Get<std::optional<std::string>>(*this, "cause");
}
std::optional<std::string> FocusShiftResult::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
std::string AutofocusResult::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
bool AutofocusResult::focused() const {
  return Access::Get<bool>(*this, "focused");
}
std::string AutofocusResult::method() const {
  return Access::Get<std::string>(*this, "method");
}
std::int64_t AutofocusResult::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
std::int64_t AutofocusResult::moves() const {
  return Access::Get<std::int64_t>(*this, "moves");
}
double AutofocusResult::elapsedMs() const {
  return Access::Get<double>(*this, "elapsedMs");
}
std::optional<double> AutofocusResult::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> AutofocusResult::sigmaD() const {
  return Access::Get<std::optional<double>>(*this, "sigmaD");
}
double AutofocusResult::position() const {
  return Access::Get<double>(*this, "position");
}
double AutofocusResult::confidence() const {
  return Access::Get<double>(*this, "confidence");
}
std::string AutofocusResult::cause() const {
  return Access::Get<std::string>(*this, "cause");
}
std::string AutofocusResult::reason() const {
  return Access::Get<std::string>(*this, "reason");
}
std::vector<AutofocusCandidate> AutofocusResult::candidates() const {
  return Access::Get<std::optional<std::vector<AutofocusCandidate>>>(*this, "candidates").value_or(std::vector<AutofocusCandidate>());
}
std::optional<AutofocusSubject> AutofocusResult::subject() const {
  return Access::Get<std::optional<AutofocusSubject>>(*this, "subject");
}
std::vector<AutofocusSample> AutofocusResult::samples() const {
  return Access::Get<std::vector<AutofocusSample>>(*this, "samples");
}
std::vector<Region> AutofocusResult::regions() const {
  return Access::Get<std::vector<Region>>(*this, "regions");
}
std::optional<AutofocusStars> AutofocusResult::stars() const {
  return Access::Get<std::optional<AutofocusStars>>(*this, "stars");
}
std::optional<SearchedUnder> AutofocusResult::conditions() const {
  return Access::Get<std::optional<SearchedUnder>>(*this, "conditions");
}
std::optional<AutofocusSlope> AutofocusResult::slope() const {
  return Access::Get<std::optional<AutofocusSlope>>(*this, "slope");
}
std::vector<AutofocusLeftOut> AutofocusResult::framesLeftOut() const {
  return Access::Get<std::optional<std::vector<AutofocusLeftOut>>>(*this, "framesLeftOut").value_or(std::vector<AutofocusLeftOut>());
}
std::int64_t AutofocusLeftOut::frame() const {
  return Access::Get<std::int64_t>(*this, "frame");
}
double AutofocusLeftOut::position() const {
  return Access::Get<double>(*this, "position");
}
std::string AutofocusLeftOut::reason() const {
  return Access::Get<std::string>(*this, "reason");
}
double KnownSlope::factor() const {
  return Access::Get<double>(*this, "factor");
}
double KnownSlope::low() const {
  return Access::Get<double>(*this, "low");
}
double KnownSlope::high() const {
  return Access::Get<double>(*this, "high");
}
std::int64_t KnownSlope::runs() const {
  return Access::Get<std::int64_t>(*this, "runs");
}
std::optional<double> KnownSlope::uneven() const {
  return Access::Get<std::optional<double>>(*this, "uneven");
}
std::optional<double> AutofocusSlope::shown() const {
  return Access::Get<std::optional<double>>(*this, "shown");
}
std::optional<KnownSlope> AutofocusSlope::known() const {
  return Access::Get<std::optional<KnownSlope>>(*this, "known");
}
bool AutofocusSlope::anotherLens() const {
  return Access::Get<bool>(*this, "anotherLens");
}
std::int64_t FocusMapCell::column() const {
  return Access::Get<std::int64_t>(*this, "column");
}
std::int64_t FocusMapCell::row() const {
  return Access::Get<std::int64_t>(*this, "row");
}
Region FocusMapCell::region() const {
  return Access::Get<Region>(*this, "region");
}
double FocusMapCell::x() const {
  return Access::Get<double>(*this, "x");
}
double FocusMapCell::y() const {
  return Access::Get<double>(*this, "y");
}
std::string FocusMapCell::cause() const {
  return Access::Get<std::string>(*this, "cause");
}
std::string FocusMapCell::reason() const {
  return Access::Get<std::string>(*this, "reason");
}
std::optional<double> FocusMapCell::position() const {
  return Access::Get<std::optional<double>>(*this, "position");
}
std::optional<double> FocusMapCell::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> FocusMapCell::extensionUm() const {
  return Access::Get<std::optional<double>>(*this, "extensionUm");
}
std::optional<double> FocusMapCell::sigmaUm() const {
  return Access::Get<std::optional<double>>(*this, "sigmaUm");
}
std::optional<double> FocusMapCell::offUm() const {
  return Access::Get<std::optional<double>>(*this, "offUm");
}
bool FocusMapCell::outlier() const {
  return Access::Get<bool>(*this, "outlier");
}
double FocusTilt::riseUm() const {
  return Access::Get<double>(*this, "riseUm");
}
double FocusTilt::sigmaUm() const {
  return Access::Get<double>(*this, "sigmaUm");
}
std::optional<double> FocusTilt::sensorDeg() const {
  return Access::Get<std::optional<double>>(*this, "sensorDeg");
}
std::optional<double> FocusTilt::sensorSigmaDeg() const {
  return Access::Get<std::optional<double>>(*this, "sensorSigmaDeg");
}
std::optional<double> FocusTilt::targetDeg() const {
  return Access::Get<std::optional<double>>(*this, "targetDeg");
}
FocusTilt FocusSurface::across() const {
  return Access::Get<FocusTilt>(*this, "across");
}
FocusTilt FocusSurface::down() const {
  return Access::Get<FocusTilt>(*this, "down");
}
std::optional<double> FocusSurface::curvatureUm() const {
  return Access::Get<std::optional<double>>(*this, "curvatureUm");
}
std::optional<double> FocusSurface::curvatureSigmaUm() const {
  return Access::Get<std::optional<double>>(*this, "curvatureSigmaUm");
}
double FocusSurface::scatterUm() const {
  return Access::Get<double>(*this, "scatterUm");
}
double FocusSurface::leftUm() const {
  return Access::Get<double>(*this, "leftUm");
}
std::optional<double> FocusSurface::leftPx() const {
  return Access::Get<std::optional<double>>(*this, "leftPx");
}
std::int64_t FocusSurface::used() const {
  return Access::Get<std::int64_t>(*this, "used");
}
std::string FocusMapResult::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
bool FocusMapResult::mapped() const {
  return Access::Get<bool>(*this, "mapped");
}
std::string FocusMapResult::cause() const {
  return Access::Get<std::string>(*this, "cause");
}
std::string FocusMapResult::reason() const {
  return Access::Get<std::string>(*this, "reason");
}
std::int64_t FocusMapResult::columns() const {
  return Access::Get<std::int64_t>(*this, "columns");
}
std::int64_t FocusMapResult::rows() const {
  return Access::Get<std::int64_t>(*this, "rows");
}
std::vector<FocusMapCell> FocusMapResult::cells() const {
  return Access::Get<std::vector<FocusMapCell>>(*this, "cells");
}
std::optional<FocusSurface> FocusMapResult::surface() const {
  return Access::Get<std::optional<FocusSurface>>(*this, "surface");
}
std::optional<double> FocusMapResult::magnification() const {
  return Access::Get<std::optional<double>>(*this, "magnification");
}
std::int64_t FocusMapResult::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
std::int64_t FocusMapResult::moves() const {
  return Access::Get<std::int64_t>(*this, "moves");
}
double FocusMapResult::elapsedMs() const {
  return Access::Get<double>(*this, "elapsedMs");
}
double FocusMapResult::position() const {
  return Access::Get<double>(*this, "position");
}
std::optional<double> FocusMapResult::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::int64_t AutofocusStep::frame() const {
  return Access::Get<std::int64_t>(*this, "frame");
}
std::int64_t AutofocusStep::framesExpected() const {
  return Access::Get<std::int64_t>(*this, "framesExpected");
}
double AutofocusStep::position() const {
  return Access::Get<double>(*this, "position");
}
std::optional<double> AutofocusStep::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
std::optional<double> AutofocusStep::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::int64_t AutofocusStep::settledAtNs() const {
  return Access::Get<std::int64_t>(*this, "settledAtNs");
}
std::vector<AutofocusSample> AutofocusStep::samples() const {
  return Access::Get<std::vector<AutofocusSample>>(*this, "samples");
}
std::string ExposureInfo::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::optional<double> ExposureInfo::exposureMs() const {
  return Access::Get<std::optional<double>>(*this, "exposureMs");
}
bool ExposureInfo::canSetExposure() const {
  return Access::Get<bool>(*this, "canSetExposure");
}
std::optional<double> ExposureInfo::exposureMinMs() const {
  return Access::Get<std::optional<double>>(*this, "exposureMinMs");
}
std::optional<double> ExposureInfo::exposureMaxMs() const {
  return Access::Get<std::optional<double>>(*this, "exposureMaxMs");
}
std::optional<double> ExposureInfo::exposureStepMs() const {
  return Access::Get<std::optional<double>>(*this, "exposureStepMs");
}
std::optional<double> ExposureInfo::gain() const {
  return Access::Get<std::optional<double>>(*this, "gain");
}
bool ExposureInfo::canSetGain() const {
  return Access::Get<bool>(*this, "canSetGain");
}
std::optional<double> ExposureInfo::gainMin() const {
  return Access::Get<std::optional<double>>(*this, "gainMin");
}
std::optional<double> ExposureInfo::gainMax() const {
  return Access::Get<std::optional<double>>(*this, "gainMax");
}
std::optional<double> ExposureInfo::gainStep() const {
  return Access::Get<std::optional<double>>(*this, "gainStep");
}
std::optional<std::string> ExposureInfo::gainUnit() const {
  return Access::Get<std::optional<std::string>>(*this, "gainUnit");
}
std::int64_t Size::widthPx() const {
  return Access::Get<std::int64_t>(*this, "widthPx");
}
Size& Size::widthPx(std::int64_t value) {
  Access::Set(*this, "widthPx", value);
  return *this;
}
std::int64_t Size::heightPx() const {
  return Access::Get<std::int64_t>(*this, "heightPx");
}
Size& Size::heightPx(std::int64_t value) {
  Access::Set(*this, "heightPx", value);
  return *this;
}
std::string PictureInfo::encoding() const {
  return Access::Get<std::string>(*this, "encoding");
}
std::int64_t PictureInfo::leftPx() const {
  return Access::Get<std::int64_t>(*this, "leftPx");
}
std::int64_t PictureInfo::topPx() const {
  return Access::Get<std::int64_t>(*this, "topPx");
}
std::int64_t PictureInfo::widthPx() const {
  return Access::Get<std::int64_t>(*this, "widthPx");
}
std::int64_t PictureInfo::heightPx() const {
  return Access::Get<std::int64_t>(*this, "heightPx");
}
std::int64_t PictureInfo::channels() const {
  return Access::Get<std::int64_t>(*this, "channels");
}
std::int64_t PictureInfo::bits() const {
  return Access::Get<std::int64_t>(*this, "bits");
}
double PictureInfo::gamma() const {
  return Access::Get<double>(*this, "gamma");
}
std::vector<std::int64_t> PictureInfo::histogram() const {
  return Access::Get<std::optional<std::vector<std::int64_t>>>(*this, "histogram").value_or(std::vector<std::int64_t>());
}
std::optional<double> PictureInfo::sharpness() const {
  return Access::Get<std::optional<double>>(*this, "sharpness");
}
std::string AxisDuring::axis() const {
  return Access::Get<std::string>(*this, "axis");
}
double AxisDuring::position() const {
  return Access::Get<double>(*this, "position");
}
double AxisDuring::positionBound() const {
  return Access::Get<double>(*this, "positionBound");
}
bool AxisDuring::moving() const {
  return Access::Get<bool>(*this, "moving");
}
std::int64_t FrameInfo::widthPx() const {
  return Access::Get<std::int64_t>(*this, "widthPx");
}
std::int64_t FrameInfo::heightPx() const {
  return Access::Get<std::int64_t>(*this, "heightPx");
}
std::int64_t FrameInfo::bits() const {
  return Access::Get<std::int64_t>(*this, "bits");
}
double FrameInfo::gamma() const {
  return Access::Get<double>(*this, "gamma");
}
std::int64_t FrameInfo::sequence() const {
  return Access::Get<std::int64_t>(*this, "sequence");
}
double FrameInfo::exposureMs() const {
  return Access::Get<double>(*this, "exposureMs");
}
std::optional<std::int64_t> FrameInfo::exposureStartNs() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "exposureStartNs");
}
std::optional<std::int64_t> FrameInfo::exposureEndNs() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "exposureEndNs");
}
std::optional<double> FrameInfo::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
std::optional<double> FrameInfo::extensionBoundUm() const {
  return Access::Get<std::optional<double>>(*this, "extensionBoundUm");
}
std::optional<double> FrameInfo::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::optional<double> FrameInfo::fNumberBound() const {
  return Access::Get<std::optional<double>>(*this, "fNumberBound");
}
bool FrameInfo::moving() const {
  return Access::Get<bool>(*this, "moving");
}
std::vector<AxisDuring> FrameInfo::axes() const {
  return Access::Get<std::vector<AxisDuring>>(*this, "axes");
}
std::optional<double> Depth::distanceM() const {
  return Access::Get<std::optional<double>>(*this, "distanceM");
}
Depth& Depth::distanceM(double value) {
  Access::Set(*this, "distanceM", value);
  return *this;
}
std::optional<double> Depth::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
Depth& Depth::vergenceD(double value) {
  Access::Set(*this, "vergenceD", value);
  return *this;
}
Depth DepthInterval::oneEnd() const {
  return Access::Get<Depth>(*this, "oneEnd");
}
DepthInterval& DepthInterval::oneEnd(const Depth& value) {
  Access::Set(*this, "oneEnd", value);
  return *this;
}
Depth DepthInterval::otherEnd() const {
  return Access::Get<Depth>(*this, "otherEnd");
}
DepthInterval& DepthInterval::otherEnd(const Depth& value) {
  Access::Set(*this, "otherEnd", value);
  return *this;
}
std::optional<std::string> BlurLimit::name() const {
  return Access::Get<std::optional<std::string>>(*this, "name");
}
BlurLimit& BlurLimit::name(const std::string& value) {
  Access::Set(*this, "name", value);
  return *this;
}
std::string BlurLimit::kind() const {
  return Access::Get<std::string>(*this, "kind");
}
BlurLimit& BlurLimit::kind(const std::string& value) {
  Access::Set(*this, "kind", value);
  return *this;
}
std::optional<double> BlurLimit::limitUm() const {
  return Access::Get<std::optional<double>>(*this, "limitUm");
}
BlurLimit& BlurLimit::limitUm(double value) {
  Access::Set(*this, "limitUm", value);
  return *this;
}
std::optional<double> BlurLimit::limitPx() const {
  return Access::Get<std::optional<double>>(*this, "limitPx");
}
BlurLimit& BlurLimit::limitPx(double value) {
  Access::Set(*this, "limitPx", value);
  return *this;
}
std::vector<DepthInterval> BlurLimit::depths() const {
  return Access::Get<std::vector<DepthInterval>>(*this, "depths");
}
BlurLimit& BlurLimit::depths(const std::vector<DepthInterval>& value) {
  Access::Set(*this, "depths", value);
  return *this;
}
std::optional<std::string> BlurLimit::side() const {
  return Access::Get<std::optional<std::string>>(*this, "side");
}
BlurLimit& BlurLimit::side(const std::string& value) {
  Access::Set(*this, "side", value);
  return *this;
}
std::optional<std::string> PlanRequest::distanceFrom() const {
  return Access::Get<std::optional<std::string>>(*this, "distanceFrom");
}
PlanRequest& PlanRequest::distanceFrom(const std::string& value) {
  Access::Set(*this, "distanceFrom", value);
  return *this;
}
std::optional<double> PlanRequest::focalLengthMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMm");
}
PlanRequest& PlanRequest::focalLengthMm(double value) {
  Access::Set(*this, "focalLengthMm", value);
  return *this;
}
std::optional<double> PlanRequest::focalLengthMinMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMinMm");
}
PlanRequest& PlanRequest::focalLengthMinMm(double value) {
  Access::Set(*this, "focalLengthMinMm", value);
  return *this;
}
std::optional<double> PlanRequest::focalLengthMaxMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMaxMm");
}
PlanRequest& PlanRequest::focalLengthMaxMm(double value) {
  Access::Set(*this, "focalLengthMaxMm", value);
  return *this;
}
std::optional<PlanRequestField> PlanRequest::field() const {
  return Access::Get<std::optional<PlanRequestField>>(*this, "field");
}
PlanRequest& PlanRequest::field(const PlanRequestField& value) {
  Access::Set(*this, "field", value);
  return *this;
}
std::optional<double> PlanRequest::sensorWidthMm() const {
  return Access::Get<std::optional<double>>(*this, "sensorWidthMm");
}
PlanRequest& PlanRequest::sensorWidthMm(double value) {
  Access::Set(*this, "sensorWidthMm", value);
  return *this;
}
std::optional<bool> PlanRequest::stack() const {
  return Access::Get<std::optional<bool>>(*this, "stack");
}
PlanRequest& PlanRequest::stack(bool value) {
  Access::Set(*this, "stack", value);
  return *this;
}
std::optional<bool> PlanRequest::aperturesAreDiameters() const {
  return Access::Get<std::optional<bool>>(*this, "aperturesAreDiameters");
}
PlanRequest& PlanRequest::aperturesAreDiameters(bool value) {
  Access::Set(*this, "aperturesAreDiameters", value);
  return *this;
}
std::optional<double> PlanRequest::apertureMin() const {
  return Access::Get<std::optional<double>>(*this, "apertureMin");
}
PlanRequest& PlanRequest::apertureMin(double value) {
  Access::Set(*this, "apertureMin", value);
  return *this;
}
std::optional<double> PlanRequest::apertureMax() const {
  return Access::Get<std::optional<double>>(*this, "apertureMax");
}
PlanRequest& PlanRequest::apertureMax(double value) {
  Access::Set(*this, "apertureMax", value);
  return *this;
}
std::vector<double> PlanRequest::stops() const {
  return Access::Get<std::optional<std::vector<double>>>(*this, "stops").value_or(std::vector<double>());
}
PlanRequest& PlanRequest::stops(const std::vector<double>& value) {
  Access::Set(*this, "stops", value);
  return *this;
}
std::optional<double> PlanRequest::extensionMinMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMinMm");
}
PlanRequest& PlanRequest::extensionMinMm(double value) {
  Access::Set(*this, "extensionMinMm", value);
  return *this;
}
std::optional<double> PlanRequest::extensionMaxMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMaxMm");
}
PlanRequest& PlanRequest::extensionMaxMm(double value) {
  Access::Set(*this, "extensionMaxMm", value);
  return *this;
}
std::optional<Depth> PlanRequest::focus() const {
  return Access::Get<std::optional<Depth>>(*this, "focus");
}
PlanRequest& PlanRequest::focus(const Depth& value) {
  Access::Set(*this, "focus", value);
  return *this;
}
std::optional<double> PlanRequest::sensorToleranceUm() const {
  return Access::Get<std::optional<double>>(*this, "sensorToleranceUm");
}
PlanRequest& PlanRequest::sensorToleranceUm(double value) {
  Access::Set(*this, "sensorToleranceUm", value);
  return *this;
}
std::optional<double> PlanRequest::fNumberTolerance() const {
  return Access::Get<std::optional<double>>(*this, "fNumberTolerance");
}
PlanRequest& PlanRequest::fNumberTolerance(double value) {
  Access::Set(*this, "fNumberTolerance", value);
  return *this;
}
std::optional<double> PlanRequest::wavelengthNm() const {
  return Access::Get<std::optional<double>>(*this, "wavelengthNm");
}
PlanRequest& PlanRequest::wavelengthNm(double value) {
  Access::Set(*this, "wavelengthNm", value);
  return *this;
}
std::optional<std::string> PlanRequest::diffraction() const {
  return Access::Get<std::optional<std::string>>(*this, "diffraction");
}
PlanRequest& PlanRequest::diffraction(const std::string& value) {
  Access::Set(*this, "diffraction", value);
  return *this;
}
std::optional<double> PlanRequest::pupilFactor() const {
  return Access::Get<std::optional<double>>(*this, "pupilFactor");
}
PlanRequest& PlanRequest::pupilFactor(double value) {
  Access::Set(*this, "pupilFactor", value);
  return *this;
}
std::optional<std::string> PlanRequest::objective() const {
  return Access::Get<std::optional<std::string>>(*this, "objective");
}
PlanRequest& PlanRequest::objective(const std::string& value) {
  Access::Set(*this, "objective", value);
  return *this;
}
std::optional<double> PlanRequest::blurLimitUm() const {
  return Access::Get<std::optional<double>>(*this, "blurLimitUm");
}
PlanRequest& PlanRequest::blurLimitUm(double value) {
  Access::Set(*this, "blurLimitUm", value);
  return *this;
}
std::optional<double> PlanRequest::blurLimitPx() const {
  return Access::Get<std::optional<double>>(*this, "blurLimitPx");
}
PlanRequest& PlanRequest::blurLimitPx(double value) {
  Access::Set(*this, "blurLimitPx", value);
  return *this;
}
std::optional<double> PlanRequest::pixelUm() const {
  return Access::Get<std::optional<double>>(*this, "pixelUm");
}
PlanRequest& PlanRequest::pixelUm(double value) {
  Access::Set(*this, "pixelUm", value);
  return *this;
}
std::optional<double> PlanRequest::modelToleranceUm() const {
  return Access::Get<std::optional<double>>(*this, "modelToleranceUm");
}
PlanRequest& PlanRequest::modelToleranceUm(double value) {
  Access::Set(*this, "modelToleranceUm", value);
  return *this;
}
std::optional<double> PlanRequest::modelTolerancePx() const {
  return Access::Get<std::optional<double>>(*this, "modelTolerancePx");
}
PlanRequest& PlanRequest::modelTolerancePx(double value) {
  Access::Set(*this, "modelTolerancePx", value);
  return *this;
}
std::vector<BlurLimit> PlanRequest::limits() const {
  return Access::Get<std::optional<std::vector<BlurLimit>>>(*this, "limits").value_or(std::vector<BlurLimit>());
}
PlanRequest& PlanRequest::limits(const std::vector<BlurLimit>& value) {
  Access::Set(*this, "limits", value);
  return *this;
}
double PlanRequestField::widthM() const {
  return Access::Get<double>(*this, "widthM");
}
double PlanRequestField::distanceM() const {
  return Access::Get<double>(*this, "distanceM");
}
std::string PlanLimit::name() const {
  return Access::Get<std::string>(*this, "name");
}
std::optional<double> PlanLimit::nearD() const {
  return Access::Get<std::optional<double>>(*this, "nearD");
}
std::optional<double> PlanLimit::farD() const {
  return Access::Get<std::optional<double>>(*this, "farD");
}
std::optional<double> PlanLimit::limitUm() const {
  return Access::Get<std::optional<double>>(*this, "limitUm");
}
std::optional<double> PlanLimit::worstUm() const {
  return Access::Get<std::optional<double>>(*this, "worstUm");
}
std::optional<double> PlanLimit::atD() const {
  return Access::Get<std::optional<double>>(*this, "atD");
}
std::optional<double> PlanLimit::ratio() const {
  return Access::Get<std::optional<double>>(*this, "ratio");
}
double StackShot::fNumber() const {
  return Access::Get<double>(*this, "fNumber");
}
double StackShot::extensionMm() const {
  return Access::Get<double>(*this, "extensionMm");
}
double StackShot::focalLengthMm() const {
  return Access::Get<double>(*this, "focalLengthMm");
}
std::optional<double> StackShot::fieldWidthM() const {
  return Access::Get<std::optional<double>>(*this, "fieldWidthM");
}
std::optional<double> StackShot::nearD() const {
  return Access::Get<std::optional<double>>(*this, "nearD");
}
std::optional<double> StackShot::farD() const {
  return Access::Get<std::optional<double>>(*this, "farD");
}
double StackShot::magnification() const {
  return Access::Get<double>(*this, "magnification");
}
std::optional<double> StackShot::focusPosition() const {
  return Access::Get<std::optional<double>>(*this, "focusPosition");
}
std::optional<double> StackShot::irisPosition() const {
  return Access::Get<std::optional<double>>(*this, "irisPosition");
}
bool PlanAnswer::feasible() const {
  return Access::Get<bool>(*this, "feasible");
}
std::optional<double> PlanAnswer::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::optional<double> PlanAnswer::focalLengthMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMm");
}
std::optional<double> PlanAnswer::fieldWidthM() const {
  return Access::Get<std::optional<double>>(*this, "fieldWidthM");
}
std::optional<double> PlanAnswer::focusPosition() const {
  return Access::Get<std::optional<double>>(*this, "focusPosition");
}
std::optional<double> PlanAnswer::irisPosition() const {
  return Access::Get<std::optional<double>>(*this, "irisPosition");
}
std::optional<double> PlanAnswer::zoomPosition() const {
  return Access::Get<std::optional<double>>(*this, "zoomPosition");
}
std::vector<StackShot> PlanAnswer::shots() const {
  return Access::Get<std::optional<std::vector<StackShot>>>(*this, "shots").value_or(std::vector<StackShot>());
}
std::optional<std::string> PlanAnswer::cause() const {
  return Access::Get<std::optional<std::string>>(*this, "cause");
}
std::optional<std::string> PlanAnswer::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
std::optional<double> PlanAnswer::apertureDiameterMm() const {
  return Access::Get<std::optional<double>>(*this, "apertureDiameterMm");
}
std::optional<double> PlanAnswer::workingFNumber() const {
  return Access::Get<std::optional<double>>(*this, "workingFNumber");
}
std::optional<double> PlanAnswer::tStop() const {
  return Access::Get<std::optional<double>>(*this, "tStop");
}
std::optional<double> PlanAnswer::lightParaxial() const {
  return Access::Get<std::optional<double>>(*this, "lightParaxial");
}
std::optional<double> PlanAnswer::lightExact() const {
  return Access::Get<std::optional<double>>(*this, "lightExact");
}
std::optional<double> PlanAnswer::subtendedAngleDeg() const {
  return Access::Get<std::optional<double>>(*this, "subtendedAngleDeg");
}
std::optional<double> PlanAnswer::magnification() const {
  return Access::Get<std::optional<double>>(*this, "magnification");
}
std::optional<double> PlanAnswer::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
std::optional<double> PlanAnswer::sensorDistanceMm() const {
  return Access::Get<std::optional<double>>(*this, "sensorDistanceMm");
}
std::optional<double> PlanAnswer::focalPlaneD() const {
  return Access::Get<std::optional<double>>(*this, "focalPlaneD");
}
std::optional<double> PlanAnswer::focalPlaneM() const {
  return Access::Get<std::optional<double>>(*this, "focalPlaneM");
}
std::optional<double> PlanAnswer::focusFromSensorM() const {
  return Access::Get<std::optional<double>>(*this, "focusFromSensorM");
}
std::optional<double> PlanAnswer::worstRatio() const {
  return Access::Get<std::optional<double>>(*this, "worstRatio");
}
std::optional<std::string> PlanAnswer::model() const {
  return Access::Get<std::optional<std::string>>(*this, "model");
}
std::optional<double> PlanAnswer::modelErrorUm() const {
  return Access::Get<std::optional<double>>(*this, "modelErrorUm");
}
std::optional<double> PlanAnswer::diffractionUm() const {
  return Access::Get<std::optional<double>>(*this, "diffractionUm");
}
std::vector<PlanLimit> PlanAnswer::limits() const {
  return Access::Get<std::optional<std::vector<PlanLimit>>>(*this, "limits").value_or(std::vector<PlanLimit>());
}
std::optional<PlanAnswerDepthOfField> PlanAnswer::depthOfField() const {
  return Access::Get<std::optional<PlanAnswerDepthOfField>>(*this, "depthOfField");
}
std::vector<std::string> PlanAnswer::conflict() const {
  return Access::Get<std::optional<std::vector<std::string>>>(*this, "conflict").value_or(std::vector<std::string>());
}
std::optional<double> PlanAnswer::relax() const {
  return Access::Get<std::optional<double>>(*this, "relax");
}
std::optional<PlanAnswerRelaxed> PlanAnswer::relaxed() const {
  return Access::Get<std::optional<PlanAnswerRelaxed>>(*this, "relaxed");
}
std::optional<std::string> PlanAnswer::note() const {
  return Access::Get<std::optional<std::string>>(*this, "note");
}
std::optional<double> PlanAnswerDepthOfField::nearD() const {
  return Access::Get<std::optional<double>>(*this, "nearD");
}
std::optional<double> PlanAnswerDepthOfField::farD() const {
  return Access::Get<std::optional<double>>(*this, "farD");
}
std::optional<double> PlanAnswerRelaxed::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::optional<double> PlanAnswerRelaxed::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
std::optional<double> PlanAnswerRelaxed::focalPlaneD() const {
  return Access::Get<std::optional<double>>(*this, "focalPlaneD");
}
std::string FoundDevice::driver() const {
  return Access::Get<std::string>(*this, "driver");
}
std::string FoundDevice::model() const {
  return Access::Get<std::string>(*this, "model");
}
std::optional<std::string> FoundDevice::serial() const {
  return Access::Get<std::optional<std::string>>(*this, "serial");
}
std::optional<std::string> FoundDevice::node() const {
  return Access::Get<std::optional<std::string>>(*this, "node");
}
bool FoundDevice::lens() const {
  return Access::Get<bool>(*this, "lens");
}
bool FoundDevice::camera() const {
  return Access::Get<bool>(*this, "camera");
}
std::string FoundDevice::config() const {
  return Access::Get<std::string>(*this, "config");
}
std::optional<std::string> FoundDevice::problem() const {
  return Access::Get<std::optional<std::string>>(*this, "problem");
}
std::optional<std::string> FoundDevice::usedBy() const {
  return Access::Get<std::optional<std::string>>(*this, "usedBy");
}
std::string FailedSearch::driver() const {
  return Access::Get<std::string>(*this, "driver");
}
std::string FailedSearch::message() const {
  return Access::Get<std::string>(*this, "message");
}
std::string LeaseInfo::holder() const {
  return Access::Get<std::string>(*this, "holder");
}
std::optional<std::int64_t> LeaseInfo::untilNs() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "untilNs");
}
std::optional<MoveProgress> Progress::move() const {
  return Access::Get<std::optional<MoveProgress>>(*this, "move");
}
std::optional<AutofocusProgress> Progress::autofocus() const {
  return Access::Get<std::optional<AutofocusProgress>>(*this, "autofocus");
}
std::optional<BacklashProgress> Progress::backlash() const {
  return Access::Get<std::optional<BacklashProgress>>(*this, "backlash");
}
std::string FaultChange::axis() const {
  return Access::Get<std::string>(*this, "axis");
}
std::optional<std::string> FaultChange::fault() const {
  return Access::Get<std::optional<std::string>>(*this, "fault");
}
std::optional<std::string> ThermometerChange::fault() const {
  return Access::Get<std::optional<std::string>>(*this, "fault");
}
std::string LeaseChange::change() const {
  return Access::Get<std::string>(*this, "change");
}
std::string LeaseChange::holder() const {
  return Access::Get<std::string>(*this, "holder");
}
std::optional<std::int64_t> LeaseChange::untilNs() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "untilNs");
}
std::optional<std::string> LeaseChange::cause() const {
  return Access::Get<std::optional<std::string>>(*this, "cause");
}
std::string CalibrationChange::grade() const {
  return Access::Get<std::string>(*this, "grade");
}
std::optional<double> CalibrationChange::errorUm() const {
  return Access::Get<std::optional<double>>(*this, "errorUm");
}
bool CalibrationChange::kept() const {
  return Access::Get<bool>(*this, "kept");
}
std::string PresetChange::change() const {
  return Access::Get<std::string>(*this, "change");
}
std::string PresetChange::label() const {
  return Access::Get<std::string>(*this, "label");
}
std::string ListChange::change() const {
  return Access::Get<std::string>(*this, "change");
}
std::optional<std::string> ListChange::connection() const {
  return Access::Get<std::optional<std::string>>(*this, "connection");
}
std::optional<std::string> ListChange::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
std::string Event::instance() const {
  return Access::Get<std::string>(*this, "instance");
}
std::string Event::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::int64_t Event::sequence() const {
  return Access::Get<std::int64_t>(*this, "sequence");
}
std::int64_t Event::lasting() const {
  return Access::Get<std::int64_t>(*this, "lasting");
}
std::optional<LensStatus> Event::status() const {
  return Access::Get<std::optional<LensStatus>>(*this, "status");
}
std::optional<Progress> Event::progress() const {
  return Access::Get<std::optional<Progress>>(*this, "progress");
}
std::optional<MoveResult> Event::move() const {
  return Access::Get<std::optional<MoveResult>>(*this, "move");
}
std::optional<AutofocusResult> Event::autofocus() const {
  return Access::Get<std::optional<AutofocusResult>>(*this, "autofocus");
}
std::optional<BacklashResult> Event::backlash() const {
  return Access::Get<std::optional<BacklashResult>>(*this, "backlash");
}
std::optional<FaultChange> Event::fault() const {
  return Access::Get<std::optional<FaultChange>>(*this, "fault");
}
std::optional<ThermometerChange> Event::thermometer() const {
  return Access::Get<std::optional<ThermometerChange>>(*this, "thermometer");
}
std::optional<LeaseChange> Event::lease() const {
  return Access::Get<std::optional<LeaseChange>>(*this, "lease");
}
std::optional<CalibrationChange> Event::calibration() const {
  return Access::Get<std::optional<CalibrationChange>>(*this, "calibration");
}
std::optional<PresetChange> Event::preset() const {
  return Access::Get<std::optional<PresetChange>>(*this, "preset");
}
std::optional<ListChange> Event::list() const {
  return Access::Get<std::optional<ListChange>>(*this, "list");
}
std::optional<Refocus> Event::refocus() const {
  return Access::Get<std::optional<Refocus>>(*this, "refocus");
}
std::string EventMark::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::int64_t EventMark::sequence() const {
  return Access::Get<std::int64_t>(*this, "sequence");
}
std::int64_t EventMark::lasting() const {
  return Access::Get<std::int64_t>(*this, "lasting");
}
double CalibrationPoint::position() const {
  return Access::Get<double>(*this, "position");
}
CalibrationPoint& CalibrationPoint::position(double value) {
  Access::Set(*this, "position", value);
  return *this;
}
std::optional<double> CalibrationPoint::distanceM() const {
  return Access::Get<std::optional<double>>(*this, "distanceM");
}
CalibrationPoint& CalibrationPoint::distanceM(double value) {
  Access::Set(*this, "distanceM", value);
  return *this;
}
std::optional<double> CalibrationPoint::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
CalibrationPoint& CalibrationPoint::vergenceD(double value) {
  Access::Set(*this, "vergenceD", value);
  return *this;
}
std::optional<double> CalibrationPoint::extensionMm() const {
  return Access::Get<std::optional<double>>(*this, "extensionMm");
}
CalibrationPoint& CalibrationPoint::extensionMm(double value) {
  Access::Set(*this, "extensionMm", value);
  return *this;
}
std::string CalibrationInfo::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::string CalibrationInfo::grade() const {
  return Access::Get<std::string>(*this, "grade");
}
std::optional<double> CalibrationInfo::errorUm() const {
  return Access::Get<std::optional<double>>(*this, "errorUm");
}
std::optional<std::string> CalibrationInfo::file() const {
  return Access::Get<std::optional<std::string>>(*this, "file");
}
std::optional<std::string> CalibrationInfo::toml() const {
  return Access::Get<std::optional<std::string>>(*this, "toml");
}
std::string BacklashResult::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::string BacklashResult::axis() const {
  return Access::Get<std::string>(*this, "axis");
}
bool BacklashResult::known() const {
  return Access::Get<bool>(*this, "known");
}
bool BacklashResult::measured() const {
  return Access::Get<bool>(*this, "measured");
}
std::optional<double> BacklashResult::size() const {
  return Access::Get<std::optional<double>>(*this, "size");
}
std::optional<double> BacklashResult::sizeLow() const {
  return Access::Get<std::optional<double>>(*this, "sizeLow");
}
std::optional<double> BacklashResult::sizeHigh() const {
  return Access::Get<std::optional<double>>(*this, "sizeHigh");
}
std::int64_t BacklashResult::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
double BacklashResult::elapsedMs() const {
  return Access::Get<double>(*this, "elapsedMs");
}
std::optional<std::string> BacklashResult::cause() const {
  return Access::Get<std::optional<std::string>>(*this, "cause");
}
std::optional<std::string> BacklashResult::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
std::int64_t BacklashProgress::sweep() const {
  return Access::Get<std::int64_t>(*this, "sweep");
}
std::int64_t BacklashProgress::sweepsExpected() const {
  return Access::Get<std::int64_t>(*this, "sweepsExpected");
}
std::int64_t BacklashProgress::frames() const {
  return Access::Get<std::int64_t>(*this, "frames");
}
std::string Preset::label() const {
  return Access::Get<std::string>(*this, "label");
}
std::string Preset::saved() const {
  return Access::Get<std::string>(*this, "saved");
}
std::optional<double> Preset::focusPosition() const {
  return Access::Get<std::optional<double>>(*this, "focusPosition");
}
std::optional<double> Preset::irisPosition() const {
  return Access::Get<std::optional<double>>(*this, "irisPosition");
}
std::optional<double> Preset::zoomPosition() const {
  return Access::Get<std::optional<double>>(*this, "zoomPosition");
}
std::optional<double> Preset::filterPosition() const {
  return Access::Get<std::optional<double>>(*this, "filterPosition");
}
bool Preset::approachUp() const {
  return Access::Get<bool>(*this, "approachUp");
}
std::optional<double> Preset::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> Preset::vergenceBoundD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceBoundD");
}
std::optional<double> Preset::focalPlaneM() const {
  return Access::Get<std::optional<double>>(*this, "focalPlaneM");
}
std::optional<double> Preset::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::optional<double> Preset::focalLengthMm() const {
  return Access::Get<std::optional<double>>(*this, "focalLengthMm");
}
std::optional<double> Preset::temperatureC() const {
  return Access::Get<std::optional<double>>(*this, "temperatureC");
}
std::string Preset::grade() const {
  return Access::Get<std::string>(*this, "grade");
}
std::string RecallResult::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::string RecallResult::label() const {
  return Access::Get<std::string>(*this, "label");
}
bool RecallResult::reached() const {
  return Access::Get<bool>(*this, "reached");
}
std::optional<double> RecallResult::vergenceBoundD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceBoundD");
}
std::optional<double> RecallResult::positionBound() const {
  return Access::Get<std::optional<double>>(*this, "positionBound");
}
std::vector<MoveResult> RecallResult::moves() const {
  return Access::Get<std::vector<MoveResult>>(*this, "moves");
}
std::optional<std::string> RecallResult::note() const {
  return Access::Get<std::optional<std::string>>(*this, "note");
}
std::string FocusAtValue::name() const {
  return Access::Get<std::string>(*this, "name");
}
FocusAtValue& FocusAtValue::name(const std::string& value) {
  Access::Set(*this, "name", value);
  return *this;
}
double FocusAtValue::value() const {
  return Access::Get<double>(*this, "value");
}
FocusAtValue& FocusAtValue::value(double value) {
  Access::Set(*this, "value", value);
  return *this;
}
std::optional<std::string> FocusAtValue::unit() const {
  return Access::Get<std::optional<std::string>>(*this, "unit");
}
FocusAtValue& FocusAtValue::unit(const std::string& value) {
  Access::Set(*this, "unit", value);
  return *this;
}
std::vector<FocusAtValue> FocusAtSample::at() const {
  return Access::Get<std::vector<FocusAtValue>>(*this, "at");
}
double FocusAtSample::position() const {
  return Access::Get<double>(*this, "position");
}
double FocusAtSample::sigma() const {
  return Access::Get<double>(*this, "sigma");
}
std::optional<double> FocusAtSample::off() const {
  return Access::Get<std::optional<double>>(*this, "off");
}
bool FocusAtSample::outlier() const {
  return Access::Get<bool>(*this, "outlier");
}
std::optional<double> FocusAtSample::temperatureC() const {
  return Access::Get<std::optional<double>>(*this, "temperatureC");
}
std::optional<double> FocusAtSample::zoomPosition() const {
  return Access::Get<std::optional<double>>(*this, "zoomPosition");
}
std::optional<double> FocusAtSample::filterPosition() const {
  return Access::Get<std::optional<double>>(*this, "filterPosition");
}
std::optional<double> FocusAtSample::fNumber() const {
  return Access::Get<std::optional<double>>(*this, "fNumber");
}
std::string FocusAtSample::made() const {
  return Access::Get<std::string>(*this, "made");
}
std::string FocusAtSurface::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::vector<FocusAtSample> FocusAtSurface::samples() const {
  return Access::Get<std::vector<FocusAtSample>>(*this, "samples");
}
bool FocusAtSurface::fitted() const {
  return Access::Get<bool>(*this, "fitted");
}
std::optional<std::string> FocusAtSurface::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
std::vector<FocusAtValue> FocusAtSurface::low() const {
  return Access::Get<std::optional<std::vector<FocusAtValue>>>(*this, "low").value_or(std::vector<FocusAtValue>());
}
std::vector<FocusAtValue> FocusAtSurface::high() const {
  return Access::Get<std::optional<std::vector<FocusAtValue>>>(*this, "high").value_or(std::vector<FocusAtValue>());
}
std::optional<bool> FocusAtSurface::curved() const {
  return Access::Get<std::optional<bool>>(*this, "curved");
}
std::optional<double> FocusAtSurface::scatter() const {
  return Access::Get<std::optional<double>>(*this, "scatter");
}
std::optional<double> FocusAtSurface::correction() const {
  return Access::Get<std::optional<double>>(*this, "correction");
}
std::vector<FocusAtValue> FocusAtSurface::next() const {
  return Access::Get<std::optional<std::vector<FocusAtValue>>>(*this, "next").value_or(std::vector<FocusAtValue>());
}
std::optional<std::string> FocusAtSurface::note() const {
  return Access::Get<std::optional<std::string>>(*this, "note");
}
std::vector<FocusAtValue> FocusAtPlace::at() const {
  return Access::Get<std::vector<FocusAtValue>>(*this, "at");
}
double FocusAtPlace::position() const {
  return Access::Get<double>(*this, "position");
}
double FocusAtPlace::sigma() const {
  return Access::Get<double>(*this, "sigma");
}
std::optional<double> FocusAtPlace::vergenceD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceD");
}
std::optional<double> FocusAtPlace::sigmaD() const {
  return Access::Get<std::optional<double>>(*this, "sigmaD");
}
std::optional<std::string> FocusAtPlace::note() const {
  return Access::Get<std::optional<std::string>>(*this, "note");
}
std::string Refocus::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::int64_t Refocus::atNs() const {
  return Access::Get<std::int64_t>(*this, "atNs");
}
std::string Refocus::cause() const {
  return Access::Get<std::string>(*this, "cause");
}
std::string Refocus::end() const {
  return Access::Get<std::string>(*this, "end");
}
std::string Refocus::reason() const {
  return Access::Get<std::string>(*this, "reason");
}
std::optional<double> Refocus::temperatureC() const {
  return Access::Get<std::optional<double>>(*this, "temperatureC");
}
std::optional<double> Refocus::position() const {
  return Access::Get<std::optional<double>>(*this, "position");
}
std::optional<double> Refocus::byUm() const {
  return Access::Get<std::optional<double>>(*this, "byUm");
}
std::int64_t DriftResult::subject() const {
  return Access::Get<std::int64_t>(*this, "subject");
}
double DriftResult::temperatureC() const {
  return Access::Get<double>(*this, "temperatureC");
}
double DriftResult::extensionUm() const {
  return Access::Get<double>(*this, "extensionUm");
}
double DriftResult::sigmaUm() const {
  return Access::Get<double>(*this, "sigmaUm");
}
double DriftResult::offUm() const {
  return Access::Get<double>(*this, "offUm");
}
bool DriftResult::outlier() const {
  return Access::Get<bool>(*this, "outlier");
}
std::string DriftResult::made() const {
  return Access::Get<std::string>(*this, "made");
}
double FocusDrift::umPerC() const {
  return Access::Get<double>(*this, "umPerC");
}
double FocusDrift::lowUmPerC() const {
  return Access::Get<double>(*this, "lowUmPerC");
}
double FocusDrift::highUmPerC() const {
  return Access::Get<double>(*this, "highUmPerC");
}
double FocusDrift::coldestC() const {
  return Access::Get<double>(*this, "coldestC");
}
double FocusDrift::hottestC() const {
  return Access::Get<double>(*this, "hottestC");
}
std::int64_t FocusDrift::results() const {
  return Access::Get<std::int64_t>(*this, "results");
}
std::string RefocusState::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
bool RefocusState::active() const {
  return Access::Get<bool>(*this, "active");
}
std::optional<std::string> RefocusState::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
std::optional<FocusDrift> RefocusState::drift() const {
  return Access::Get<std::optional<FocusDrift>>(*this, "drift");
}
std::optional<std::string> RefocusState::driftReason() const {
  return Access::Get<std::optional<std::string>>(*this, "driftReason");
}
std::vector<DriftResult> RefocusState::results() const {
  return Access::Get<std::vector<DriftResult>>(*this, "results");
}
std::optional<Refocus> RefocusState::last() const {
  return Access::Get<std::optional<Refocus>>(*this, "last");
}
double LearnedRun::shown() const {
  return Access::Get<double>(*this, "shown");
}
double LearnedRun::position() const {
  return Access::Get<double>(*this, "position");
}
double LearnedRun::blurPxPerUnit() const {
  return Access::Get<double>(*this, "blurPxPerUnit");
}
double LearnedRun::pixelUm() const {
  return Access::Get<double>(*this, "pixelUm");
}
std::optional<double> LearnedRun::irisPosition() const {
  return Access::Get<std::optional<double>>(*this, "irisPosition");
}
std::optional<double> LearnedRun::zoomPosition() const {
  return Access::Get<std::optional<double>>(*this, "zoomPosition");
}
bool LearnedRun::framesFromOutside() const {
  return Access::Get<bool>(*this, "framesFromOutside");
}
std::optional<double> LearnedRun::aboveOverBelow() const {
  return Access::Get<std::optional<double>>(*this, "aboveOverBelow");
}
bool LearnedRun::holds() const {
  return Access::Get<bool>(*this, "holds");
}
std::string LearnedRun::made() const {
  return Access::Get<std::string>(*this, "made");
}
std::string LearnedState::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::optional<KnownSlope> LearnedState::known() const {
  return Access::Get<std::optional<KnownSlope>>(*this, "known");
}
std::optional<std::string> LearnedState::reason() const {
  return Access::Get<std::optional<std::string>>(*this, "reason");
}
std::vector<LearnedRun> LearnedState::runs() const {
  return Access::Get<std::vector<LearnedRun>>(*this, "runs");
}
std::string UndoResult::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
bool UndoResult::undone() const {
  return Access::Get<bool>(*this, "undone");
}
std::optional<double> UndoResult::vergenceBoundD() const {
  return Access::Get<std::optional<double>>(*this, "vergenceBoundD");
}
std::optional<double> UndoResult::positionBound() const {
  return Access::Get<std::optional<double>>(*this, "positionBound");
}
std::vector<MoveResult> UndoResult::moves() const {
  return Access::Get<std::vector<MoveResult>>(*this, "moves");
}
std::optional<std::string> UndoResult::note() const {
  return Access::Get<std::optional<std::string>>(*this, "note");
}
std::vector<LensInfo> ListReply::lenses() const {
  return Access::Get<std::vector<LensInfo>>(*this, "lenses");
}
std::string ListReply::instance() const {
  return Access::Get<std::string>(*this, "instance");
}
std::vector<std::string> ListReply::features() const {
  return Access::Get<std::vector<std::string>>(*this, "features");
}
std::vector<FoundDevice> DevicesReply::devices() const {
  return Access::Get<std::vector<FoundDevice>>(*this, "devices");
}
std::vector<FailedSearch> DevicesReply::failed() const {
  return Access::Get<std::vector<FailedSearch>>(*this, "failed");
}
std::vector<std::string> ReloadReply::added() const {
  return Access::Get<std::vector<std::string>>(*this, "added");
}
std::vector<std::string> ReloadReply::removed() const {
  return Access::Get<std::vector<std::string>>(*this, "removed");
}
std::vector<std::string> ReloadReply::reopened() const {
  return Access::Get<std::vector<std::string>>(*this, "reopened");
}
std::vector<std::string> ReloadReply::unchanged() const {
  return Access::Get<std::vector<std::string>>(*this, "unchanged");
}
std::vector<LensStatus> StatusReply::lenses() const {
  return Access::Get<std::vector<LensStatus>>(*this, "lenses");
}
StatusParameters& StatusParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
std::vector<LensMetrics> MetricsReply::lenses() const {
  return Access::Get<std::vector<LensMetrics>>(*this, "lenses");
}
std::optional<DaemonMetrics> MetricsReply::daemon() const {
  return Access::Get<std::optional<DaemonMetrics>>(*this, "daemon");
}
MetricsParameters& MetricsParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
Event MonitorReply::event() const {
  return Access::Get<Event>(*this, "event");
}
MonitorParameters& MonitorParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
MonitorParameters& MonitorParameters::minIntervalMs(double value) {
  Access::Set(*this, "minIntervalMs", value);
  return *this;
}
std::optional<MoveProgress> MoveReply::progress() const {
  return Access::Get<std::optional<MoveProgress>>(*this, "progress");
}
std::optional<MoveResult> MoveReply::move() const {
  return Access::Get<std::optional<MoveResult>>(*this, "move");
}
MoveParameters& MoveParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
MoveParameters& MoveParameters::axis(const std::string& value) {
  Access::Set(*this, "axis", value);
  return *this;
}
MoveParameters& MoveParameters::target(const Target& value) {
  Access::Set(*this, "target", value);
  return *this;
}
MoveParameters& MoveParameters::distanceFrom(const std::string& value) {
  Access::Set(*this, "distanceFrom", value);
  return *this;
}
MoveParameters& MoveParameters::keepFocus(bool value) {
  Access::Set(*this, "keepFocus", value);
  return *this;
}
MoveParameters& MoveParameters::trackingToleranceUm(double value) {
  Access::Set(*this, "trackingToleranceUm", value);
  return *this;
}
MoveParameters& MoveParameters::keepBrightness(bool value) {
  Access::Set(*this, "keepBrightness", value);
  return *this;
}
MoveParameters& MoveParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
CalibrationInfo GetCalibrationReply::calibration() const {
  return Access::Get<CalibrationInfo>(*this, "calibration");
}
GetCalibrationParameters& GetCalibrationParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
CalibrationInfo CalibrateReply::calibration() const {
  return Access::Get<CalibrationInfo>(*this, "calibration");
}
CalibrateParameters& CalibrateParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::toml(const std::string& value) {
  Access::Set(*this, "toml", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::points(const std::vector<CalibrationPoint>& value) {
  Access::Set(*this, "points", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::distanceFrom(const std::string& value) {
  Access::Set(*this, "distanceFrom", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::errorUm(double value) {
  Access::Set(*this, "errorUm", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::approximate(bool value) {
  Access::Set(*this, "approximate", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::made(const std::string& value) {
  Access::Set(*this, "made", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::remove(bool value) {
  Access::Set(*this, "remove", value);
  return *this;
}
CalibrateParameters& CalibrateParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::optional<BacklashProgress> MeasureBacklashReply::progress() const {
  return Access::Get<std::optional<BacklashProgress>>(*this, "progress");
}
std::optional<BacklashResult> MeasureBacklashReply::backlash() const {
  return Access::Get<std::optional<BacklashResult>>(*this, "backlash");
}
MeasureBacklashParameters& MeasureBacklashParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
MeasureBacklashParameters& MeasureBacklashParameters::axis(const std::string& value) {
  Access::Set(*this, "axis", value);
  return *this;
}
MeasureBacklashParameters& MeasureBacklashParameters::size(double value) {
  Access::Set(*this, "size", value);
  return *this;
}
MeasureBacklashParameters& MeasureBacklashParameters::pairs(std::int64_t value) {
  Access::Set(*this, "pairs", value);
  return *this;
}
MeasureBacklashParameters& MeasureBacklashParameters::region(const Region& value) {
  Access::Set(*this, "region", value);
  return *this;
}
MeasureBacklashParameters& MeasureBacklashParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::optional<FocusShiftProgress> MeasureFocusShiftReply::progress() const {
  return Access::Get<std::optional<FocusShiftProgress>>(*this, "progress");
}
std::optional<FocusShiftResult> MeasureFocusShiftReply::shift() const {
  return Access::Get<std::optional<FocusShiftResult>>(*this, "shift");
}
MeasureFocusShiftParameters& MeasureFocusShiftParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
MeasureFocusShiftParameters& MeasureFocusShiftParameters::conditions(const SearchConditions& value) {
  Access::Set(*this, "conditions", value);
  return *this;
}
MeasureFocusShiftParameters& MeasureFocusShiftParameters::pairs(std::int64_t value) {
  Access::Set(*this, "pairs", value);
  return *this;
}
MeasureFocusShiftParameters& MeasureFocusShiftParameters::region(const Region& value) {
  Access::Set(*this, "region", value);
  return *this;
}
MeasureFocusShiftParameters& MeasureFocusShiftParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::vector<FocusShift> ListFocusShiftsReply::shifts() const {
  return Access::Get<std::vector<FocusShift>>(*this, "shifts");
}
ListFocusShiftsParameters& ListFocusShiftsParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
RemoveFocusShiftParameters& RemoveFocusShiftParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
RemoveFocusShiftParameters& RemoveFocusShiftParameters::fromFNumber(double value) {
  Access::Set(*this, "fromFNumber", value);
  return *this;
}
RemoveFocusShiftParameters& RemoveFocusShiftParameters::toFNumber(double value) {
  Access::Set(*this, "toFNumber", value);
  return *this;
}
RemoveFocusShiftParameters& RemoveFocusShiftParameters::fromFilter(double value) {
  Access::Set(*this, "fromFilter", value);
  return *this;
}
RemoveFocusShiftParameters& RemoveFocusShiftParameters::toFilter(double value) {
  Access::Set(*this, "toFilter", value);
  return *this;
}
RemoveFocusShiftParameters& RemoveFocusShiftParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
FocusAtSurface FocusAtAddReply::surface() const {
  return Access::Get<FocusAtSurface>(*this, "surface");
}
FocusAtAddParameters& FocusAtAddParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
FocusAtAddParameters& FocusAtAddParameters::at(const std::vector<FocusAtValue>& value) {
  Access::Set(*this, "at", value);
  return *this;
}
FocusAtAddParameters& FocusAtAddParameters::position(double value) {
  Access::Set(*this, "position", value);
  return *this;
}
FocusAtAddParameters& FocusAtAddParameters::sigma(double value) {
  Access::Set(*this, "sigma", value);
  return *this;
}
FocusAtAddParameters& FocusAtAddParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
FocusAtSurface FocusAtGetReply::surface() const {
  return Access::Get<FocusAtSurface>(*this, "surface");
}
std::optional<FocusAtPlace> FocusAtGetReply::place() const {
  return Access::Get<std::optional<FocusAtPlace>>(*this, "place");
}
FocusAtGetParameters& FocusAtGetParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
FocusAtGetParameters& FocusAtGetParameters::at(const std::vector<FocusAtValue>& value) {
  Access::Set(*this, "at", value);
  return *this;
}
FocusAtPlace FocusAtReply::place() const {
  return Access::Get<FocusAtPlace>(*this, "place");
}
MoveResult FocusAtReply::move() const {
  return Access::Get<MoveResult>(*this, "move");
}
FocusAtParameters& FocusAtParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
FocusAtParameters& FocusAtParameters::at(const std::vector<FocusAtValue>& value) {
  Access::Set(*this, "at", value);
  return *this;
}
FocusAtParameters& FocusAtParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::optional<bool> FocusAtForgetReply::removed() const {
  return Access::Get<std::optional<bool>>(*this, "removed");
}
FocusAtForgetParameters& FocusAtForgetParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
FocusAtForgetParameters& FocusAtForgetParameters::sample(std::int64_t value) {
  Access::Set(*this, "sample", value);
  return *this;
}
FocusAtForgetParameters& FocusAtForgetParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
RefocusState GetRefocusReply::refocus() const {
  return Access::Get<RefocusState>(*this, "refocus");
}
GetRefocusParameters& GetRefocusParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
ForgetDriftParameters& ForgetDriftParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
ForgetDriftParameters& ForgetDriftParameters::result(std::int64_t value) {
  Access::Set(*this, "result", value);
  return *this;
}
ForgetDriftParameters& ForgetDriftParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
LearnedState GetLearnedReply::learned() const {
  return Access::Get<LearnedState>(*this, "learned");
}
GetLearnedParameters& GetLearnedParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
ForgetLearnedParameters& ForgetLearnedParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
ForgetLearnedParameters& ForgetLearnedParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
KeepDirectionParameters& KeepDirectionParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
KeepDirectionParameters& KeepDirectionParameters::direction(const std::string& value) {
  Access::Set(*this, "direction", value);
  return *this;
}
KeepDirectionParameters& KeepDirectionParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
Preset PresetSaveReply::preset() const {
  return Access::Get<Preset>(*this, "preset");
}
PresetSaveParameters& PresetSaveParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
PresetSaveParameters& PresetSaveParameters::label(const std::string& value) {
  Access::Set(*this, "label", value);
  return *this;
}
PresetSaveParameters& PresetSaveParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::vector<Preset> PresetListReply::presets() const {
  return Access::Get<std::vector<Preset>>(*this, "presets");
}
PresetListParameters& PresetListParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
RecallResult PresetRecallReply::recall() const {
  return Access::Get<RecallResult>(*this, "recall");
}
PresetRecallParameters& PresetRecallParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
PresetRecallParameters& PresetRecallParameters::label(const std::string& value) {
  Access::Set(*this, "label", value);
  return *this;
}
PresetRecallParameters& PresetRecallParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
PresetRemoveParameters& PresetRemoveParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
PresetRemoveParameters& PresetRemoveParameters::label(const std::string& value) {
  Access::Set(*this, "label", value);
  return *this;
}
PresetRemoveParameters& PresetRemoveParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
UndoResult UndoReply::undo() const {
  return Access::Get<UndoResult>(*this, "undo");
}
UndoParameters& UndoParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
UndoParameters& UndoParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::vector<MoveResult> HomeReply::moves() const {
  return Access::Get<std::vector<MoveResult>>(*this, "moves");
}
HomeParameters& HomeParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
HomeParameters& HomeParameters::axis(const std::string& value) {
  Access::Set(*this, "axis", value);
  return *this;
}
HomeParameters& HomeParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
SetPositionParameters& SetPositionParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
SetPositionParameters& SetPositionParameters::axis(const std::string& value) {
  Access::Set(*this, "axis", value);
  return *this;
}
SetPositionParameters& SetPositionParameters::position(double value) {
  Access::Set(*this, "position", value);
  return *this;
}
SetPositionParameters& SetPositionParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
StopParameters& StopParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
StopParameters& StopParameters::axis(const std::string& value) {
  Access::Set(*this, "axis", value);
  return *this;
}
StopParameters& StopParameters::latch(bool value) {
  Access::Set(*this, "latch", value);
  return *this;
}
ResetFaultsParameters& ResetFaultsParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
ResetFaultsParameters& ResetFaultsParameters::axis(const std::string& value) {
  Access::Set(*this, "axis", value);
  return *this;
}
ResetFaultsParameters& ResetFaultsParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::string TakeLeaseReply::lens() const {
  return Access::Get<std::string>(*this, "lens");
}
std::string TakeLeaseReply::lease() const {
  return Access::Get<std::string>(*this, "lease");
}
TakeLeaseParameters& TakeLeaseParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
TakeLeaseParameters& TakeLeaseParameters::forMs(double value) {
  Access::Set(*this, "forMs", value);
  return *this;
}
TakeLeaseParameters& TakeLeaseParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
TakeLeaseParameters& TakeLeaseParameters::takeOver(bool value) {
  Access::Set(*this, "takeOver", value);
  return *this;
}
TakeLeaseParameters& TakeLeaseParameters::stop(bool value) {
  Access::Set(*this, "stop", value);
  return *this;
}
std::int64_t HoldReply::untilNs() const {
  return Access::Get<std::int64_t>(*this, "untilNs");
}
bool HoldReply::atRest() const {
  return Access::Get<bool>(*this, "atRest");
}
HoldParameters& HoldParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
HoldParameters& HoldParameters::untilNs(std::int64_t value) {
  Access::Set(*this, "untilNs", value);
  return *this;
}
ReleaseParameters& ReleaseParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
DropLeaseParameters& DropLeaseParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
DropLeaseParameters& DropLeaseParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
PlanAnswer PlanReply::plan() const {
  return Access::Get<PlanAnswer>(*this, "plan");
}
std::optional<PlanAnswer> PlanReply::nearest() const {
  return Access::Get<std::optional<PlanAnswer>>(*this, "nearest");
}
std::vector<MoveResult> PlanReply::applied() const {
  return Access::Get<std::optional<std::vector<MoveResult>>>(*this, "applied").value_or(std::vector<MoveResult>());
}
std::optional<PlanAnswer> PlanReply::reached() const {
  return Access::Get<std::optional<PlanAnswer>>(*this, "reached");
}
std::optional<PlanRequest> PlanReply::request() const {
  return Access::Get<std::optional<PlanRequest>>(*this, "request");
}
PlanParameters& PlanParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
PlanParameters& PlanParameters::request(const PlanRequest& value) {
  Access::Set(*this, "request", value);
  return *this;
}
PlanParameters& PlanParameters::apply(bool value) {
  Access::Set(*this, "apply", value);
  return *this;
}
PlanParameters& PlanParameters::showRequest(bool value) {
  Access::Set(*this, "showRequest", value);
  return *this;
}
PlanParameters& PlanParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::optional<AutofocusProgress> AutofocusReply::progress() const {
  return Access::Get<std::optional<AutofocusProgress>>(*this, "progress");
}
std::optional<AutofocusResult> AutofocusReply::autofocus() const {
  return Access::Get<std::optional<AutofocusResult>>(*this, "autofocus");
}
AutofocusParameters& AutofocusParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::region(const Region& value) {
  Access::Set(*this, "region", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::method(const std::string& value) {
  Access::Set(*this, "method", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::regions(const std::vector<Region>& value) {
  Access::Set(*this, "regions", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::policy(const std::string& value) {
  Access::Set(*this, "policy", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::track(bool value) {
  Access::Set(*this, "track", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::range(const FocusRange& value) {
  Access::Set(*this, "range", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::step(const FocusStep& value) {
  Access::Set(*this, "step", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::distanceFrom(const std::string& value) {
  Access::Set(*this, "distanceFrom", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::deadlineMs(double value) {
  Access::Set(*this, "deadlineMs", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
AutofocusParameters& AutofocusParameters::conditions(const SearchConditions& value) {
  Access::Set(*this, "conditions", value);
  return *this;
}
std::optional<AutofocusProgress> FocusMapReply::progress() const {
  return Access::Get<std::optional<AutofocusProgress>>(*this, "progress");
}
std::optional<FocusMapResult> FocusMapReply::map() const {
  return Access::Get<std::optional<FocusMapResult>>(*this, "map");
}
FocusMapParameters& FocusMapParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
FocusMapParameters& FocusMapParameters::columns(std::int64_t value) {
  Access::Set(*this, "columns", value);
  return *this;
}
FocusMapParameters& FocusMapParameters::rows(std::int64_t value) {
  Access::Set(*this, "rows", value);
  return *this;
}
FocusMapParameters& FocusMapParameters::range(const FocusRange& value) {
  Access::Set(*this, "range", value);
  return *this;
}
FocusMapParameters& FocusMapParameters::distanceFrom(const std::string& value) {
  Access::Set(*this, "distanceFrom", value);
  return *this;
}
FocusMapParameters& FocusMapParameters::deadlineMs(double value) {
  Access::Set(*this, "deadlineMs", value);
  return *this;
}
FocusMapParameters& FocusMapParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::int64_t AutofocusBeginReply::session() const {
  return Access::Get<std::int64_t>(*this, "session");
}
AutofocusStep AutofocusBeginReply::next() const {
  return Access::Get<AutofocusStep>(*this, "next");
}
AutofocusBeginParameters& AutofocusBeginParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::region(const Region& value) {
  Access::Set(*this, "region", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::method(const std::string& value) {
  Access::Set(*this, "method", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::pixelUm(double value) {
  Access::Set(*this, "pixelUm", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::scores(bool value) {
  Access::Set(*this, "scores", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::deadlineMs(double value) {
  Access::Set(*this, "deadlineMs", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::regions(const std::vector<Region>& value) {
  Access::Set(*this, "regions", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::policy(const std::string& value) {
  Access::Set(*this, "policy", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::range(const FocusRange& value) {
  Access::Set(*this, "range", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::step(const FocusStep& value) {
  Access::Set(*this, "step", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::distanceFrom(const std::string& value) {
  Access::Set(*this, "distanceFrom", value);
  return *this;
}
AutofocusBeginParameters& AutofocusBeginParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::int64_t AutofocusPixelsReply::received() const {
  return Access::Get<std::int64_t>(*this, "received");
}
AutofocusPixelsParameters& AutofocusPixelsParameters::session(std::int64_t value) {
  Access::Set(*this, "session", value);
  return *this;
}
AutofocusPixelsParameters& AutofocusPixelsParameters::offset(std::int64_t value) {
  Access::Set(*this, "offset", value);
  return *this;
}
AutofocusPixelsParameters& AutofocusPixelsParameters::data(const std::string& value) {
  Access::Set(*this, "data", value);
  return *this;
}
std::optional<AutofocusStep> AutofocusFrameReply::next() const {
  return Access::Get<std::optional<AutofocusStep>>(*this, "next");
}
std::optional<AutofocusResult> AutofocusFrameReply::autofocus() const {
  return Access::Get<std::optional<AutofocusResult>>(*this, "autofocus");
}
AutofocusFrameParameters& AutofocusFrameParameters::session(std::int64_t value) {
  Access::Set(*this, "session", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::widthPx(std::int64_t value) {
  Access::Set(*this, "widthPx", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::heightPx(std::int64_t value) {
  Access::Set(*this, "heightPx", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::strideBytes(std::int64_t value) {
  Access::Set(*this, "strideBytes", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::format(const std::string& value) {
  Access::Set(*this, "format", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::gamma(double value) {
  Access::Set(*this, "gamma", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::exposureStartNs(std::int64_t value) {
  Access::Set(*this, "exposureStartNs", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::exposureEndNs(std::int64_t value) {
  Access::Set(*this, "exposureEndNs", value);
  return *this;
}
AutofocusFrameParameters& AutofocusFrameParameters::data(const std::string& value) {
  Access::Set(*this, "data", value);
  return *this;
}
std::optional<AutofocusStep> AutofocusScoreReply::next() const {
  return Access::Get<std::optional<AutofocusStep>>(*this, "next");
}
std::optional<AutofocusResult> AutofocusScoreReply::autofocus() const {
  return Access::Get<std::optional<AutofocusResult>>(*this, "autofocus");
}
AutofocusScoreParameters& AutofocusScoreParameters::session(std::int64_t value) {
  Access::Set(*this, "session", value);
  return *this;
}
AutofocusScoreParameters& AutofocusScoreParameters::sharpness(double value) {
  Access::Set(*this, "sharpness", value);
  return *this;
}
AutofocusScoreParameters& AutofocusScoreParameters::sigma(double value) {
  Access::Set(*this, "sigma", value);
  return *this;
}
AutofocusScoreParameters& AutofocusScoreParameters::exposureStartNs(std::int64_t value) {
  Access::Set(*this, "exposureStartNs", value);
  return *this;
}
AutofocusScoreParameters& AutofocusScoreParameters::exposureEndNs(std::int64_t value) {
  Access::Set(*this, "exposureEndNs", value);
  return *this;
}
AutofocusEndParameters& AutofocusEndParameters::session(std::int64_t value) {
  Access::Set(*this, "session", value);
  return *this;
}
std::string SnapshotReply::data() const {
  return Access::Get<std::string>(*this, "data");
}
std::int64_t SnapshotReply::offset() const {
  return Access::Get<std::int64_t>(*this, "offset");
}
std::int64_t SnapshotReply::size() const {
  return Access::Get<std::int64_t>(*this, "size");
}
std::optional<FrameInfo> SnapshotReply::frame() const {
  return Access::Get<std::optional<FrameInfo>>(*this, "frame");
}
std::optional<PictureInfo> SnapshotReply::picture() const {
  return Access::Get<std::optional<PictureInfo>>(*this, "picture");
}
SnapshotParameters& SnapshotParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
SnapshotParameters& SnapshotParameters::inMotion(bool value) {
  Access::Set(*this, "inMotion", value);
  return *this;
}
SnapshotParameters& SnapshotParameters::region(const Region& value) {
  Access::Set(*this, "region", value);
  return *this;
}
SnapshotParameters& SnapshotParameters::scaleTo(const Size& value) {
  Access::Set(*this, "scaleTo", value);
  return *this;
}
SnapshotParameters& SnapshotParameters::encoding(const std::string& value) {
  Access::Set(*this, "encoding", value);
  return *this;
}
ExposureInfo GetExposureReply::exposure() const {
  return Access::Get<ExposureInfo>(*this, "exposure");
}
GetExposureParameters& GetExposureParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
ExposureInfo SetExposureReply::exposure() const {
  return Access::Get<ExposureInfo>(*this, "exposure");
}
SetExposureParameters& SetExposureParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
SetExposureParameters& SetExposureParameters::exposureMs(double value) {
  Access::Set(*this, "exposureMs", value);
  return *this;
}
SetExposureParameters& SetExposureParameters::gain(double value) {
  Access::Set(*this, "gain", value);
  return *this;
}
SetExposureParameters& SetExposureParameters::lease(const std::string& value) {
  Access::Set(*this, "lease", value);
  return *this;
}
std::optional<FrameInfo> ViewReply::frame() const {
  return Access::Get<std::optional<FrameInfo>>(*this, "frame");
}
std::optional<PictureInfo> ViewReply::picture() const {
  return Access::Get<std::optional<PictureInfo>>(*this, "picture");
}
std::optional<std::int64_t> ViewReply::dropped() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "dropped");
}
std::optional<std::string> ViewReply::data() const {
  return Access::Get<std::optional<std::string>>(*this, "data");
}
std::optional<std::int64_t> ViewReply::fd() const {
  return Access::Get<std::optional<std::int64_t>>(*this, "fd");
}
std::int64_t ViewReply::offset() const {
  return Access::Get<std::int64_t>(*this, "offset");
}
std::int64_t ViewReply::size() const {
  return Access::Get<std::int64_t>(*this, "size");
}
ViewParameters& ViewParameters::lens(const std::string& value) {
  Access::Set(*this, "lens", value);
  return *this;
}
ViewParameters& ViewParameters::maxRateHz(double value) {
  Access::Set(*this, "maxRateHz", value);
  return *this;
}
ViewParameters& ViewParameters::region(const Region& value) {
  Access::Set(*this, "region", value);
  return *this;
}
ViewParameters& ViewParameters::scaleTo(const Size& value) {
  Access::Set(*this, "scaleTo", value);
  return *this;
}
ViewParameters& ViewParameters::encoding(const std::string& value) {
  Access::Set(*this, "encoding", value);
  return *this;
}
ViewParameters& ViewParameters::inMotion(bool value) {
  Access::Set(*this, "inMotion", value);
  return *this;
}
ViewParameters& ViewParameters::fd(bool value) {
  Access::Set(*this, "fd", value);
  return *this;
}

}  // namespace v1
}  // namespace lensd
