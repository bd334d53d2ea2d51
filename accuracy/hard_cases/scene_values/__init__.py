"""Hard cases J: values of a scene, its units, and what its picture must not depend on."""
