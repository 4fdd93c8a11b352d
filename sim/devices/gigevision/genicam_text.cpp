// The GenICam XML of the simulated camera, node by node, with whichever names its lens features are to have.
#include "genicam_text.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <sstream>
#include <string_view>
#include <vector>

namespace lensd::sim {
namespace {

/// What the lens' features are called. Empty: this camera has none.
struct Names {
  std::string_view set;
  std::string_view focus, iris, zoom;
  std::string_view selector, controller, status, ready;
  std::string_view initialize, abort, disconnect, temperature;
};

constexpr std::array kNames = {
    Names{"sfnc", "FocusStepper", "Aperture", "FocalLength", "OpticControllerSelector", "OpticController0",
          "OpticControllerStatus", "Ready", "OpticControllerInitialize", "OpticControllerAbort",
          "OpticControllerDisconnect", "OpticControllerTemperature"},
    Names{"basler", "FocusStepper", "ApertureStepper", "FocalLengthStepper", "OpticControllerSelector", "Optic1",
          "OpticControllerStatus", "NotBusy", "OpticControllerInitialize", "", "OpticControllerDisconnect", ""},
    Names{"allied-vision", "EFLensFocusCurrent", "EFLensFStopCurrent", "EFLensZoomCurrent", "", "", "", "",
          "EFLensInitialize", "", "", ""},
    Names{"sfnc-abort", "FocusStepper", "Aperture", "FocalLength", "", "", "", "", "", "OpticControllerAbort", "", ""},
    Names{"imaging-source", "Focus", "Iris", "Zoom", "", "", "", "", "", "", "", ""},
    Names{"none", "", "", "", "", "", "", "", "", "", "", ""},
};

std::string Hex(unsigned address) {
  std::ostringstream text;
  text << "0x" << std::hex << address;
  return text.str();
}

std::string Number(double value) {
  std::ostringstream text;
  text << std::setprecision(12) << value;
  return text.str();
}

/// Builds the file node by node. `Text()` ends it.
class Document {
 public:
  void Category(std::string_view name, const std::vector<std::string>& features) {
    body_ << "<Category Name=\"" << name << "\" NameSpace=\"Standard\">\n";
    for (const std::string& feature : features) body_ << "  <pFeature>" << feature << "</pFeature>\n";
    body_ << "</Category>\n";
  }

  void Register(const std::string& name, unsigned address, std::string_view access = "RW", int length = 4) {
    body_ << "<IntReg Name=\"" << name << "\"><Address>" << Hex(address) << "</Address><Length>" << length
          << "</Length><AccessMode>" << access
          << "</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign>"
             "<Endianess>BigEndian</Endianess></IntReg>\n";
  }

  void Text(std::string_view name, unsigned address, int length) {
    body_ << "<StringReg Name=\"" << name << "\"><Address>" << Hex(address) << "</Address><Length>" << length
          << "</Length><AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n";
  }

  /// An integer feature over a register of its own.
  void Integer(const std::string& name, unsigned address, double low, double high, std::string_view access = "RW") {
    IntegerOver(name, name + "Register", low, high);
    Register(name + "Register", address, access);
  }

  void IntegerOver(std::string_view name, std::string_view value, double low, double high) {
    body_ << "<Integer Name=\"" << name << "\" NameSpace=\"Standard\"><pValue>" << value << "</pValue><Min>"
          << Number(low) << "</Min><Max>" << Number(high) << "</Max><Inc>1</Inc></Integer>\n";
  }

  void FloatOver(std::string_view name, std::string_view value, double low, double high, double step = 0.0) {
    body_ << "<Float Name=\"" << name << "\" NameSpace=\"Standard\"><pValue>" << value << "</pValue><Min>"
          << Number(low) << "</Min><Max>" << Number(high) << "</Max>";
    if (step > 0.0) body_ << "<Inc>" << Number(step) << "</Inc>";
    body_ << "</Float>\n";
  }

  void Command(const std::string& name, const std::string& value, unsigned number) {
    body_ << "<Command Name=\"" << name << "\" NameSpace=\"Standard\"><pValue>" << value << "</pValue><CommandValue>"
          << number << "</CommandValue></Command>\n";
  }

  using Entries = std::vector<std::pair<std::string, unsigned>>;
  void Enumeration(const std::string& name, unsigned address, const Entries& entries, std::string_view access = "RW") {
    body_ << "<Enumeration Name=\"" << name << "\" NameSpace=\"Standard\">";
    for (const auto& [entry, value] : entries) {
      body_ << "<EnumEntry Name=\"" << entry << "\"><Value>" << value << "</Value></EnumEntry>";
    }
    body_ << "<pValue>" << name << "Register</pValue></Enumeration>\n";
    Register(name + "Register", address, access);
  }

  /// `kind` is IntConverter or Converter; `variables` are name and node.
  void Converter(std::string_view kind, const std::string& name, const std::string& variables, const std::string& to,
                 const std::string& from, const std::string& value) {
    body_ << "<" << kind << " Name=\"" << name << "\">" << variables << "<FormulaTo>" << to
          << "</FormulaTo><FormulaFrom>" << from << "</FormulaFrom><pValue>" << value << "</pValue></" << kind << ">\n";
  }

  void Raw(std::string_view text) { body_ << text << "\n"; }

  std::string Finish() const {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
           "<RegisterDescription ModelName=\"Lens\" VendorName=\"lensd\" StandardNameSpace=\"None\" "
           "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" "
           "MinorVersion=\"0\" SubMinorVersion=\"0\" ProductGuid=\"6c656e73-6400-4000-8000-000000000001\" "
           "VersionGuid=\"6c656e73-6400-4000-8000-000000000002\" "
           "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n" +
           body_.str() + "<Port Name=\"Device\"/>\n</RegisterDescription>\n";
  }

 private:
  std::ostringstream body_;
};

/// One more than the count, and the top bit other than it was.
constexpr std::string_view kMark = "1 + (1 - (OLD &gt;&gt; 31)) * 2147483648";

/// A position: written to the target, read from where the lens is. A client that wants to know the limits converts
/// those of the register, which are never written: they map to themselves.
void AddAxis(Document& document, std::string_view feature, const LensAxisText& axis, const std::string& part,
             unsigned target, unsigned place) {
  document.Register(part + "Target", target);
  document.Register(part + "Place", place, "RO");
  const std::string variables =
      "<pVariable Name=\"OLD\">" + part + "Target</pVariable><pVariable Name=\"PLACE\">" + part + "Place</pVariable>";
  const bool whole = axis.per_count == 1.0 && axis.zero == 0.0;
  const std::string zero = Number(axis.zero), per = Number(axis.per_count), mark(kMark);
  const std::string to = whole ? "FROM + " + mark : "FLOOR((FROM - (" + zero + ")) / " + per + " + 0.5) + " + mark;
  const std::string place_or_end = "(TO = 0 ? 0 : (TO = 4294967295 ? 4294967295 : PLACE))";
  const std::string from = whole ? place_or_end : "(" + zero + ") + " + place_or_end + " * " + per;
  document.Converter(whole ? "IntConverter" : "Converter", part + "Converter", variables, to, from, part + "Target");
  const std::string name(feature);
  if (whole) document.IntegerOver(name, part + "Converter", axis.minimum, axis.maximum);
  if (!whole) document.FloatOver(name, part + "Converter", axis.minimum, axis.maximum, axis.step);
}

/// A command whose register also says which targets it came after.
void AddCommand(Document& document, std::string_view name, unsigned address, const GenicamOptions& options) {
  const std::string part(name);
  document.Register(part + "Register", address);
  std::string variables = "<pVariable Name=\"FOCUS\">FocusTarget</pVariable>";
  std::string to = "FROM + (FOCUS &gt;&gt; 31) * 2";
  if (options.iris) variables += "<pVariable Name=\"IRIS\">IrisTarget</pVariable>", to += " + (IRIS &gt;&gt; 31) * 4";
  if (options.zoom) variables += "<pVariable Name=\"ZOOM\">ZoomTarget</pVariable>", to += " + (ZOOM &gt;&gt; 31) * 8";
  document.Converter("IntConverter", part + "Converter", variables, to, "TO", part + "Register");
  document.Command(part, part + "Converter", 1);
}

void AddLens(Document& document, const Names& names, const GenicamOptions& options, std::vector<std::string>& lens) {
  if (names.focus.empty()) return;
  const std::string_view focus = options.focus_is_power ? "FocalPower" : names.focus;
  AddAxis(document, focus, options.focus, "Focus", registers::kFocusTarget, registers::kFocusPlace);
  lens.emplace_back(focus);
  if (options.iris) {
    AddAxis(document, names.iris, *options.iris, "Iris", registers::kIrisTarget, registers::kIrisPlace);
    lens.emplace_back(names.iris);
  }
  if (options.zoom) {
    AddAxis(document, names.zoom, *options.zoom, "Zoom", registers::kZoomTarget, registers::kZoomPlace);
    lens.emplace_back(names.zoom);
  }
  if (!names.selector.empty()) {
    document.Enumeration(std::string(names.selector), registers::kSelector, {{std::string(names.controller), 0}});
    lens.emplace_back(names.selector);
  }
  if (!names.status.empty()) {
    document.Enumeration(std::string(names.status), registers::kStatus,
                         {{"NotConnected", 0},
                          {"NotInitialized", 1},
                          {"NotSupported", 2},
                          {"Busy", 3},
                          {std::string(names.ready), 4},
                          {"Error", 5}},
                         "RO");
    lens.emplace_back(names.status);
  }
  const std::pair<std::string_view, unsigned> commands[] = {{names.initialize, registers::kInitialize},
                                                            {names.abort, registers::kAbort},
                                                            {names.disconnect, registers::kDisconnect}};
  for (const auto& [name, address] : commands) {
    if (name.empty()) continue;
    AddCommand(document, name, address, options);
    lens.emplace_back(name);
  }
  if (!names.temperature.empty()) {
    document.Register("TemperatureRegister", registers::kTemperature, "RO");
    document.Converter("Converter", "TemperatureConverter", "", "FROM * 100", "TO / 100", "TemperatureRegister");
    document.FloatOver(names.temperature, "TemperatureConverter", -100.0, 200.0);
    lens.emplace_back(names.temperature);
  }
}

void AddFormat(Document& document, const GenicamOptions& options) {
  document.Category("ImageFormatControl", {"SensorWidth", "SensorHeight", "OffsetX", "OffsetY", "Width", "Height",
                                           "PixelFormat", "SensorPixelWidth"});
  document.Integer("SensorWidth", 0x118, 0, 65535, "RO");
  document.Integer("SensorHeight", 0x11c, 0, 65535, "RO");
  document.Integer("OffsetX", 0x130, 0, options.width - 1);
  document.Integer("OffsetY", 0x134, 0, options.height - 1);
  document.Integer("Width", 0x100, 1, options.width);
  document.Integer("Height", 0x104, 1, options.height);
  document.Enumeration("PixelFormat", 0x128,
                       {{"Mono8", 0x01080001},
                        {"Mono10", 0x01100003},
                        {"Mono12", 0x01100005},
                        {"Mono12Packed", 0x010C0006},
                        {"Mono12p", 0x010C0047},
                        {"Mono16", 0x01100007},
                        {"BayerRG8", 0x01080009},
                        {"RGB8", 0x02180014}});
  document.Register("PixelPitchRegister", registers::kPixelPitch, "RO");
  document.Converter("Converter", "PixelPitchConverter", "", "FROM * 1000", "TO / 1000", "PixelPitchRegister");
  document.FloatOver("SensorPixelWidth", "PixelPitchConverter", 0.0, 1000.0);
}

void AddAcquisition(Document& document) {
  document.Category("AcquisitionControl", {"AcquisitionStart", "AcquisitionStop", "AcquisitionMode",
                                           "AcquisitionFrameRate", "TriggerSelector", "TriggerMode", "TriggerSource",
                                           "TriggerActivation", "TriggerSoftware", "ExposureTime"});
  document.Register("AcquisitionRegister", 0x124, "WO");
  document.Command("AcquisitionStart", "AcquisitionRegister", 1);
  document.Command("AcquisitionStop", "AcquisitionRegister", 0);
  document.Enumeration("AcquisitionMode", 0x12c, {{"Continuous", 1}, {"SingleFrame", 2}, {"MultiFrame", 3}});
  document.Integer("FramePeriod", 0x138, 1000, 10000000);
  document.Converter("Converter", "FrameRateConverter", "", "1000000 / FROM", "1000000 / TO", "FramePeriod");
  document.FloatOver("AcquisitionFrameRate", "FrameRateConverter", 0.1, 1000.0);
  document.Raw(
      "<Enumeration Name=\"TriggerSelector\" NameSpace=\"Standard\"><EnumEntry Name=\"FrameStart\"><Value>0</Value>"
      "</EnumEntry><pValue>TriggerSelected</pValue></Enumeration><Integer Name=\"TriggerSelected\"><Value>0</Value>"
      "</Integer>");
  document.Enumeration("TriggerMode", 0x300, {{"Off", 0}, {"On", 1}});
  document.Enumeration("TriggerSource", 0x304, {{"Line0", 0}, {"Software", 1}});
  document.Enumeration("TriggerActivation", 0x308, {{"RisingEdge", 0}});
  document.Register("TriggerSoftwareRegister", 0x30c, "WO");
  document.Command("TriggerSoftware", "TriggerSoftwareRegister", 1);
  document.Register("ExposureRegister", 0x120);
  document.Converter("Converter", "ExposureConverter", "", "FROM", "TO", "ExposureRegister");
  document.FloatOver("ExposureTime", "ExposureConverter", 10.0, 10000000.0);
}

void AddTransport(Document& document) {
  document.Category("TransportLayerControl", {"PayloadSize", "GevSCPSPacketSize", "GevTimestampControlLatch",
                                              "GevTimestampValue", "GevTimestampTickFrequency", "TLParamsLocked"});
  document.Raw(
      "<IntSwissKnife Name=\"PayloadSize\" NameSpace=\"Standard\"><pVariable Name=\"W\">Width</pVariable>"
      "<pVariable Name=\"H\">Height</pVariable><pVariable Name=\"FORMAT\">PixelFormat</pVariable>"
      "<Formula>W * H * ((FORMAT &gt;&gt; 16) &amp; 0xFF) / 8</Formula></IntSwissKnife>");
  document.Integer("GevSCPSPacketSize", 0x0d04, 576, 16260);
  document.Register("TimestampControlRegister", registers::kTimestampControl);
  document.Command("GevTimestampControlLatch", "TimestampControlRegister", 2);
  document.Register("GevTimestampValue", registers::kTimestampHigh, "RO", 8);
  document.Register("GevTimestampTickFrequency", 0x093c, "RO", 8);
  document.Raw("<Integer Name=\"TLParamsLocked\"><Value>0</Value><Min>0</Min><Max>1</Max></Integer>");
}

}  // namespace

std::string GenicamText(const GenicamOptions& options) {
  const auto* names = std::ranges::find(kNames, options.names, &Names::set);
  if (names == kNames.end()) return "";
  Document document;
  std::vector<std::string> lens;
  document.Category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl", "AnalogControl",
                             "OpticControl", "TransportLayerControl"});
  document.Category("DeviceControl", {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceSerialNumber"});
  document.Text("DeviceVendorName", 0x48, 32);
  document.Text("DeviceModelName", 0x68, 32);
  document.Text("DeviceVersion", 0x88, 32);
  document.Text("DeviceSerialNumber", 0xd8, 16);
  AddFormat(document, options);
  AddAcquisition(document);
  document.Category("AnalogControl", {"GainRaw"});
  document.Integer("GainRaw", 0x110, 0, 24);
  AddLens(document, *names, options, lens);
  document.Category("OpticControl", lens);
  AddTransport(document);
  return document.Finish();
}

}  // namespace lensd::sim
