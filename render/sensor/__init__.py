"""From radiance to digital numbers: the sensor, its response, blur and speckle."""
