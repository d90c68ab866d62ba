#include <fcntl.h>
#include <linux/videodev2.h>

#include <cctype>
#include <cmath>
#include <cstring>
#include <sstream>

#include "v4l2/v4l2_controls.h"
#include "v4l2/v4l2_ioctl.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

template <size_t kSize>
std::string textOf(const __u8 (&field)[kSize]) {
  const auto* text = reinterpret_cast<const char*>(field);
  return std::string(text, strnlen(text, kSize));
}

// Keeps letters and digits and replaces anything between them by an underscore, like v4l2-ctl.
std::string controlName(const std::string& title) {
  std::string name;
  bool gap = false;
  for (const char character : title) {
    if (std::isalnum(static_cast<unsigned char>(character)) != 0) {
      name += gap && !name.empty() ? "_" : "";
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(character)));
      gap = false;
    } else {
      gap = true;
    }
  }
  return name;
}

std::string listRates(int fd, uint32_t fourcc, uint32_t width, uint32_t height) {
  std::ostringstream text;
  v4l2_frmivalenum interval{};
  interval.pixel_format = fourcc;
  interval.width = width;
  interval.height = height;
  for (; interval.index < 32 && v4l2Ioctl(fd, VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0; ++interval.index) {
    if (interval.type != V4L2_FRMIVAL_TYPE_DISCRETE || interval.discrete.numerator == 0) {
      break;
    }
    text << (interval.index == 0 ? " (" : ", ")
         << static_cast<double>(interval.discrete.denominator) / interval.discrete.numerator;
  }
  return text.str().empty() ? "" : text.str() + " Hz)";
}

void listFormats(int fd, V4l2Description* description) {
  v4l2_fmtdesc format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; format.index < 256 && v4l2Ioctl(fd, VIDIOC_ENUM_FMT, &format) == 0; ++format.index) {
    bool understood = false;
    for (const PixelFormat known : allPixelFormats()) {
      understood = understood || fourccOf(known) == format.pixelformat;
    }
    const std::string name = fourccText(format.pixelformat);
    v4l2_frmsizeenum size{};
    size.pixel_format = format.pixelformat;
    for (; size.index < 256 && v4l2Ioctl(fd, VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
      std::ostringstream text;
      if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
        text << name << " " << size.discrete.width << "x" << size.discrete.height
             << listRates(fd, format.pixelformat, size.discrete.width, size.discrete.height);
      } else {
        text << name << " " << size.stepwise.min_width << "x" << size.stepwise.min_height << " to "
             << size.stepwise.max_width << "x" << size.stepwise.max_height;
      }
      description->formats.push_back(text.str() + (understood ? "" : " *"));
    }
    if (size.index == 0) {
      description->formats.push_back(name + (understood ? "" : " *"));
    }
  }
}

}  // namespace

std::vector<V4l2Control> listControls(int fd) {
  std::vector<V4l2Control> controls;
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  // Drivers list a few dozen controls; the limit ends an endless list of a broken driver.
  for (int i = 0; i < 1024 && v4l2Ioctl(fd, VIDIOC_QUERYCTRL, &query) == 0; ++i) {
    const bool has_value = query.type == V4L2_CTRL_TYPE_INTEGER || query.type == V4L2_CTRL_TYPE_BOOLEAN ||
                           query.type == V4L2_CTRL_TYPE_MENU || query.type == V4L2_CTRL_TYPE_INTEGER_MENU;
    v4l2_control value{query.id, 0};
    if (has_value && (query.flags & V4L2_CTRL_FLAG_DISABLED) == 0 &&
        v4l2Ioctl(fd, VIDIOC_G_CTRL, &value) == 0) {
      V4l2Control control;
      control.id = query.id;
      control.name = controlName(textOf(query.name));
      control.minimum = query.minimum;
      control.maximum = query.maximum;
      control.step = query.step;
      control.default_value = query.default_value;
      control.value = value.value;
      controls.push_back(control);
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

V4l2Description describeV4l2Device(const std::string& path) {
  const FileDescriptor fd(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  v4l2_capability capability{};
  if (!fd || v4l2Ioctl(fd.get(), VIDIOC_QUERYCAP, &capability) != 0) {
    throw InputError(path + ": " + (fd ? "is not a V4L2 device: " : "cannot be opened: ") +
                     std::strerror(errno));
  }
  V4l2Description description;
  description.path = path;
  description.card = textOf(capability.card);
  description.driver = textOf(capability.driver);
  description.bus = textOf(capability.bus_info);
  const uint32_t flags = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                               : capability.capabilities;
  description.captures = (flags & V4L2_CAP_VIDEO_CAPTURE) != 0 && (flags & V4L2_CAP_STREAMING) != 0;
  if (description.captures) {
    listFormats(fd.get(), &description);
  }
  description.controls = listControls(fd.get());
  return description;
}

std::pair<std::string, int32_t> parseControl(const std::string& text) {
  const size_t equals = text.find('=');
  const std::string number = equals == std::string::npos ? "" : text.substr(equals + 1);
  try {
    size_t used = 0;
    const int value = std::stoi(number, &used);
    if (equals > 0 && used == number.size()) {
      return {text.substr(0, equals), value};
    }
  } catch (const std::logic_error&) {  // not a number, or too large: reported below
  }
  throw InputError("expected 'name=whole number', got '" + text + "'");
}

}  // namespace vcharge
