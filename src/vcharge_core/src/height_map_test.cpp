#include "vcharge_core/height_map.h"

#include <gtest/gtest.h>
