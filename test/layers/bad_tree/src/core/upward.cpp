#include "photosphere/image/image.h"
