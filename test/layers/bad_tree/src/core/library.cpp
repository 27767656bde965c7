#include <nanoflann.hpp>
#include <spdlog/spdlog.h>
