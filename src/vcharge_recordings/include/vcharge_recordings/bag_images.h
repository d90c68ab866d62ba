#pragma once

#include <functional>
#include <string>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/frames/image.h"

namespace vcharge {

/// An image with its message's stamp.
struct StampedImage {
  Timestamp stamp;
  Image image;
};

/// Images of one topic of a bag, raw or, where the bag has only that, from <topic>/compressed; where there
/// are more than `max_images`, as many of them, evenly spread. `progress` takes the share done. InputError
/// names the bag, the topic and what was expected, for a bag that cannot be read, a topic that it lacks (with
/// those it has) or that has no images, and images that cannot be decoded.
std::vector<StampedImage> readBagImages(const std::string& bag_path, const std::string& topic, int max_images,
                                        const std::function<void(double)>& progress);

}  // namespace vcharge
