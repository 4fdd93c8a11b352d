// A kernel with one video node whose controls are a table, each with the defects that the test gives it. It knows no
// more of V4L2 than the calls that open, ask, set and read one control, and the pictures' format.
#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "kernel.h"

namespace lensd::drivers::v4l2 {

/// How often a call fails before it works, and with which errno; a negative count: always.
struct Failing {
  int error = 0;
  int count = 0;

  /// 0, or the errno of this call.
  int Next() {
    if (count == 0) return 0;
    if (count > 0) --count;
    return error;
  }
};

struct TableControl {
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  std::int64_t minimum = 0, maximum = 0;
  std::uint64_t step = 1;
  std::int64_t value = 0;
  std::uint32_t flags = 0;
  Failing query{}, get{}, set{};
};

struct TablePictures {
  std::uint32_t code = V4L2_PIX_FMT_GREY;
  std::uint32_t width = 320, height = 240;
  Failing get_format{};
};

class TableKernel final : public Kernel {
 public:
  std::map<std::uint32_t, TableControl> controls;
  TablePictures pictures;
  Failing capability;

  /// Lines of a .ctl file: ID TYPE MIN MAX STEP DEFAULT VALUE FLAGS [err N | geterr N], ID and FLAGS hexadecimal.
  void ReadTable(const std::string& path) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      std::uint32_t id = 0;
      TableControl control;
      std::int64_t ignored = 0;
      words >> std::hex >> id >> std::dec >> control.type >> control.minimum >> control.maximum >> control.step >>
          ignored >> control.value >> std::hex >> control.flags >> std::dec;
      if (!words) continue;
      std::string how;
      int argument = 0;
      if (words >> how >> argument) (how == "geterr" ? control.get : control.set) = {argument, -1};
      controls[id] = control;
    }
  }

  int Open(const std::string&) override { return 7; }
  void Close(int) override {}
  int Ioctl(int, unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP:
        return Capability(static_cast<v4l2_capability*>(argument));
      case VIDIOC_QUERY_EXT_CTRL:
        return Query(static_cast<v4l2_query_ext_ctrl*>(argument));
      case VIDIOC_G_EXT_CTRLS:
        return Get(static_cast<v4l2_ext_controls*>(argument)->controls[0]);
      case VIDIOC_S_EXT_CTRLS:
        return Set(static_cast<v4l2_ext_controls*>(argument)->controls[0]);
      case VIDIOC_SUBSCRIBE_EVENT:
        return 0;
      case VIDIOC_DQEVENT:
        return -ENOENT;
      case VIDIOC_ENUM_FMT:
        return Format(static_cast<v4l2_fmtdesc*>(argument));
      case VIDIOC_G_FMT:
      case VIDIOC_S_FMT:
        return Format(static_cast<v4l2_format*>(argument));
      default:
        return -ENOTTY;
    }
  }
  void* Map(int, std::size_t, std::int64_t) override { return nullptr; }
  void Unmap(void*, std::size_t) override {}
  int Read(int, void*, std::size_t) override { return -EINVAL; }
  std::vector<std::string> List(const std::string&, const std::string&) override { return {}; }
  std::string Text(const std::string&) override { return ""; }

 private:
  int Capability(v4l2_capability* about) {
    if (const int error = capability.Next()) return -error;
    std::snprintf(reinterpret_cast<char*>(about->driver), sizeof about->driver, "table");
    std::snprintf(reinterpret_cast<char*>(about->card), sizeof about->card, "Table Camera");
    about->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    return 0;
  }
  int Query(v4l2_query_ext_ctrl* query) {
    const auto found = controls.find(query->id);
    if (found == controls.end()) return -EINVAL;
    TableControl& control = found->second;
    if (const int error = control.query.Next()) return -error;
    query->type = control.type;
    std::snprintf(query->name, sizeof query->name, "control %x", query->id);
    query->minimum = control.minimum;
    query->maximum = control.maximum;
    query->step = control.step;
    query->flags = control.flags;
    return 0;
  }
  int Get(v4l2_ext_control& one) {
    const auto found = controls.find(one.id);
    if (found == controls.end()) return -EINVAL;
    if (const int error = found->second.get.Next()) return -error;
    one.value = static_cast<__s32>(found->second.value);
    return 0;
  }
  int Set(const v4l2_ext_control& one) {
    const auto found = controls.find(one.id);
    if (found == controls.end()) return -EINVAL;
    if (const int error = found->second.set.Next()) return -error;
    found->second.value = one.value;
    return 0;
  }
  int Format(v4l2_fmtdesc* description) const {
    if (description->index > 0) return -EINVAL;
    description->pixelformat = pictures.code;
    return 0;
  }
  int Format(v4l2_format* format) {
    if (const int error = pictures.get_format.Next()) return -error;
    format->fmt.pix.width = pictures.width;
    format->fmt.pix.height = pictures.height;
    format->fmt.pix.pixelformat = pictures.code;
    format->fmt.pix.bytesperline = pictures.width;
    return 0;
  }
};

}  // namespace lensd::drivers::v4l2
