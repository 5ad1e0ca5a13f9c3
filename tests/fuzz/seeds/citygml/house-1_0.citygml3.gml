<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/3.0" xmlns:bldg="http://www.opengis.net/citygml/building/3.0" xmlns:con="http://www.opengis.net/citygml/construction/3.0" xmlns:dem="http://www.opengis.net/citygml/relief/3.0" xmlns:gen="http://www.opengis.net/citygml/generics/3.0" xmlns:gml="http://www.opengis.net/gml/3.2" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://www.opengis.net/citygml/building/3.0 http://schemas.opengis.net/citygml/building/3.0/building.xsd http://www.opengis.net/citygml/relief/3.0 http://schemas.opengis.net/citygml/relief/3.0/relief.xsd http://www.opengis.net/citygml/generics/3.0 http://schemas.opengis.net/citygml/generics/3.0/generics.xsd" gml:id="city-model">
 <gml:name>mesh, tile 1_0</gml:name>
 <gml:boundedBy>
  <gml:Envelope srsName="urn:ogc:def:crs:EPSG::7415" srsDimension="3">
   <gml:lowerCorner>85010.7275 445999.5 100.1525</gml:lowerCorner>
   <gml:upperCorner>85042 446027.3838 110.8478</gml:upperCorner>
  </gml:Envelope>
 </gml:boundedBy>
 <cityObjectMember>
  <dem:ReliefFeature gml:id="terrain-1-0-relief">
   <dem:lod>1</dem:lod>
   <dem:reliefComponent>
    <dem:TINRelief gml:id="terrain-1-0">
     <dem:lod>1</dem:lod>
     <dem:tin>
      <gml:TriangulatedSurface gml:id="terrain-1-0_tin">
       <gml:patches>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85020 445999.5 100.2501 85042 445999.5 100.1525 85032 446011.5 100.4193 85020 445999.5 100.2501</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85020 445999.5 100.2501 85032 446011.5 100.4193 85020 446021.5 101.372 85020 445999.5 100.2501</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85042 445999.5 100.1525 85042 446021.5 101.0514 85032 446011.5 100.4193 85042 445999.5 100.1525</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85032 446011.5 100.4193 85042 446021.5 101.0514 85020 446021.5 101.372 85032 446011.5 100.4193</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
       </gml:patches>
      </gml:TriangulatedSurface>
     </dem:tin>
    </dem:TINRelief>
   </dem:reliefComponent>
  </dem:ReliefFeature>
 </cityObjectMember>
 <cityObjectMember>
  <bldg:Building gml:id="b-85014-446018">
   <genericAttribute>
    <gen:StringAttribute>
     <gen:name>block</gen:name>
     <gen:value>1_0</gen:value>
    </gen:StringAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:DoubleAttribute>
     <gen:name>building_probability</gen:name>
     <gen:value>0.85</gen:value>
    </gen:DoubleAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:DoubleAttribute>
     <gen:name>completeness</gen:name>
     <gen:value>0.998</gen:value>
    </gen:DoubleAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:DoubleAttribute>
     <gen:name>cut_share</gen:name>
     <gen:value>0</gen:value>
    </gen:DoubleAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:MeasureAttribute>
     <gen:name>eave_height_m</gen:name>
     <gen:value uom="m">107.53</gen:value>
    </gen:MeasureAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:MeasureAttribute>
     <gen:name>footprint_area_m2</gen:name>
     <gen:value uom="m2">164.9</gen:value>
    </gen:MeasureAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:MeasureAttribute>
     <gen:name>ground_height_m</gen:name>
     <gen:value uom="m">101</gen:value>
    </gen:MeasureAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:StringAttribute>
     <gen:name>method</gen:name>
     <gen:value>gable</gen:value>
    </gen:StringAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:MeasureAttribute>
     <gen:name>ridge_height_m</gen:name>
     <gen:value uom="m">110.85</gen:value>
    </gen:MeasureAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:MeasureAttribute>
     <gen:name>rmse_m</gen:name>
     <gen:value uom="m">0.139</gen:value>
    </gen:MeasureAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:MeasureAttribute>
     <gen:name>volume_m3</gen:name>
     <gen:value uom="m3">1285.71</gen:value>
    </gen:MeasureAttribute>
   </genericAttribute>
   <genericAttribute>
    <gen:DoubleAttribute>
     <gen:name>wall_share</gen:name>
     <gen:value>0.97</gen:value>
    </gen:DoubleAttribute>
   </genericAttribute>
   <boundary>
    <con:GroundSurface gml:id="b-85014-446018_lod0_ground">
     <lod0MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod0_ground_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod0_ground_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85029.3105 446017.7227 100.9968 85013.9902 446012.5488 100.9968 85010.7275 446022.21 100.9968 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod0MultiSurface>
    </con:GroundSurface>
   </boundary>
   <boundary>
    <con:RoofSurface gml:id="b-85014-446018_lod0_roof">
     <lod0MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod0_roof_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod0_roof_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 107.5343 85013.9902 446012.5488 107.5343 85029.3105 446017.7227 107.5343 85026.0488 446027.3838 107.5343 85010.7275 446022.21 107.5343</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod0MultiSurface>
    </con:RoofSurface>
   </boundary>
   <boundary>
    <con:RoofSurface gml:id="b-85014-446018_lod2_0">
     <genericAttribute>
      <gen:MeasureAttribute>
       <gen:name>azimuth_deg</gen:name>
       <gen:value uom="deg">341.34</gen:value>
      </gen:MeasureAttribute>
     </genericAttribute>
     <genericAttribute>
      <gen:MeasureAttribute>
       <gen:name>slope_deg</gen:name>
       <gen:value uom="deg">38.86</gen:value>
      </gen:MeasureAttribute>
     </genericAttribute>
     <lod2MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod2_0_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_0_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 106.7399 85012.3584 446017.3799 110.8478 85027.6797 446022.5537 110.8478 85026.0488 446027.3838 106.7399 85010.7275 446022.21 106.7399</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod2MultiSurface>
    </con:RoofSurface>
   </boundary>
   <boundary>
    <con:RoofSurface gml:id="b-85014-446018_lod2_1">
     <genericAttribute>
      <gen:MeasureAttribute>
       <gen:name>azimuth_deg</gen:name>
       <gen:value uom="deg">161.34</gen:value>
      </gen:MeasureAttribute>
     </genericAttribute>
     <genericAttribute>
      <gen:MeasureAttribute>
       <gen:name>slope_deg</gen:name>
       <gen:value uom="deg">38.86</gen:value>
      </gen:MeasureAttribute>
     </genericAttribute>
     <lod2MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod2_1_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_1_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85012.3584 446017.3799 110.8478 85013.9902 446012.5488 106.7399 85029.3105 446017.7227 106.7402 85027.6797 446022.5537 110.8478 85012.3584 446017.3799 110.8478</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod2MultiSurface>
    </con:RoofSurface>
   </boundary>
   <boundary>
    <con:WallSurface gml:id="b-85014-446018_lod2_2">
     <lod2MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod2_2_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_2_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85010.7275 446022.21 100.9968 85010.7275 446022.21 106.7399 85026.0488 446027.3838 106.7399 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod2MultiSurface>
    </con:WallSurface>
   </boundary>
   <boundary>
    <con:WallSurface gml:id="b-85014-446018_lod2_3">
     <lod2MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod2_3_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_3_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 100.9968 85013.9902 446012.5488 100.9968 85013.9902 446012.5488 106.7399 85012.3584 446017.3799 110.8478 85010.7275 446022.21 106.7399 85010.7275 446022.21 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod2MultiSurface>
    </con:WallSurface>
   </boundary>
   <boundary>
    <con:WallSurface gml:id="b-85014-446018_lod2_4">
     <lod2MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod2_4_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_4_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85013.9902 446012.5488 100.9968 85029.3105 446017.7227 100.9968 85029.3105 446017.7227 106.7402 85013.9902 446012.5488 106.7399 85013.9902 446012.5488 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod2MultiSurface>
    </con:WallSurface>
   </boundary>
   <boundary>
    <con:WallSurface gml:id="b-85014-446018_lod2_5">
     <lod2MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod2_5_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_5_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85029.3105 446017.7227 100.9968 85026.0488 446027.3838 100.9968 85026.0488 446027.3838 106.7399 85027.6797 446022.5537 110.8478 85029.3105 446017.7227 106.7402 85029.3105 446017.7227 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod2MultiSurface>
    </con:WallSurface>
   </boundary>
   <boundary>
    <con:GroundSurface gml:id="b-85014-446018_lod2_6">
     <lod2MultiSurface>
      <gml:MultiSurface gml:id="b-85014-446018_lod2_6_surface">
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod2_6_poly_0">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85029.3105 446017.7227 100.9968 85013.9902 446012.5488 100.9968 85010.7275 446022.21 100.9968 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:MultiSurface>
     </lod2MultiSurface>
    </con:GroundSurface>
   </boundary>
   <lod1Solid>
    <gml:Solid gml:id="b-85014-446018_lod1_solid">
     <gml:exterior>
      <gml:Shell>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod1_0_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 108.7939 85013.9902 446012.5488 108.7939 85029.3105 446017.7227 108.7939 85026.0488 446027.3838 108.7939 85010.7275 446022.21 108.7939</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod1_1_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85010.7275 446022.21 100.9968 85010.7275 446022.21 108.7939 85026.0488 446027.3838 108.7939 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod1_2_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85010.7275 446022.21 100.9968 85013.9902 446012.5488 100.9968 85013.9902 446012.5488 108.7939 85010.7275 446022.21 108.7939 85010.7275 446022.21 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod1_3_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85013.9902 446012.5488 100.9968 85029.3105 446017.7227 100.9968 85029.3105 446017.7227 108.7939 85013.9902 446012.5488 108.7939 85013.9902 446012.5488 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod1_4_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85029.3105 446017.7227 100.9968 85026.0488 446027.3838 100.9968 85026.0488 446027.3838 108.7939 85029.3105 446017.7227 108.7939 85029.3105 446017.7227 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
       <gml:surfaceMember>
        <gml:Polygon gml:id="b-85014-446018_lod1_5_poly">
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85026.0488 446027.3838 100.9968 85029.3105 446017.7227 100.9968 85013.9902 446012.5488 100.9968 85010.7275 446022.21 100.9968 85026.0488 446027.3838 100.9968</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Polygon>
       </gml:surfaceMember>
      </gml:Shell>
     </gml:exterior>
    </gml:Solid>
   </lod1Solid>
   <lod2Solid>
    <gml:Solid gml:id="b-85014-446018_lod2_solid">
     <gml:exterior>
      <gml:Shell>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_0_poly_0"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_1_poly_0"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_2_poly_0"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_3_poly_0"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_4_poly_0"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_5_poly_0"/>
       <gml:surfaceMember xlink:href="#b-85014-446018_lod2_6_poly_0"/>
      </gml:Shell>
     </gml:exterior>
    </gml:Solid>
   </lod2Solid>
   <con:height>
    <con:Height>
     <con:highReference codeSpace="http://inspire.ec.europa.eu/codelist/ElevationReferenceValue">highestPoint</con:highReference>
     <con:lowReference codeSpace="http://inspire.ec.europa.eu/codelist/ElevationReferenceValue">generalGround</con:lowReference>
     <con:status>measured</con:status>
     <con:value uom="m">9.85</con:value>
    </con:Height>
   </con:height>
   <bldg:roofType codeSpace="http://www.sig3d.org/codelists/standard/building/2.0/_AbstractBuilding_roofType.xml">1030</bldg:roofType>
  </bldg:Building>
 </cityObjectMember>
</CityModel>
