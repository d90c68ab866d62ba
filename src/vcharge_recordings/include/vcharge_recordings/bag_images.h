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

/// Images of one topic of a bag, raw or, where the bag has only that, from <topic>/compressed; of more
/// than `max_images` an evenly spread selection. `progress` receives the fraction done. InputError names the
/// bag, the topic and what was expected, for a bag that cannot be read, a missing topic (with those that
/// there are), a topic without images, and images that cannot be decoded.
std::vector<StampedImage> readBagImages(const std::string& bag_path, const std::string& topic, int max_images,
                                        const std::function<void(double)>& progress);

}  // namespace vcharge
