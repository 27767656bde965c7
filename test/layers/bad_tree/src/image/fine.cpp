#include "photosphere/core/error.h"
