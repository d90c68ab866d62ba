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

/// Reads the images of a topic of a bag, or of <topic>/compressed if the bag has no raw ones; evenly spread
/// ones if there are more than `max_images`. `progress` receives the fraction done. InputError names the
/// bag, the topic and what was expected, for a bag that cannot be read, a missing topic (with those that
/// exist), a topic without images, and images that cannot be decoded.
std::vector<StampedImage> readBagImages(const std::string& bag_path, const std::string& topic, int max_images,
                                        const std::function<void(double)>& progress);

}  // namespace vcharge
