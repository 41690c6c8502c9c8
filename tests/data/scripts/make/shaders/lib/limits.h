#pragma once
#include <vector2.h>
#define EDGE 0.25
